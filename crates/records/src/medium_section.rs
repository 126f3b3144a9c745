//! `[medium]`: the air as assumed for the simulation.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Spanned;

use super::section::{Key, Section, written};
use fieldgap_acoustics::Medium;
use fieldgap_input::{Fault, Finite, SoundSpeed, TomlSource, literal};

/// Temperatures for which the formula for air is used, °C: those of laboratories, somewhat more than the 0 to 30 °C for which its
/// source states an accuracy.
const TEMPERATURES_C: std::ops::RangeInclusive<f64> = -20.0..=50.0;
/// Pressures for which the formula for air is used, kPa: from a high mountain to a strong anticyclone.
const PRESSURES_KPA: std::ops::RangeInclusive<f64> = 60.0..=110.0;

/// Relative humidity where none is given, percent: that of rooms. At 20 °C dry air and moist air differ by 0.4 % in their speed of sound.
const USUAL_HUMIDITY_PERCENT: f64 = 50.0;
/// Pressure where none is given, kPa: the standard atmosphere. The weather's 3 kPa change the speed of sound by about 0.005 %.
const USUAL_PRESSURE_KPA: f64 = 101.325;

/// The keys of a `[medium]`, a speed of sound or a temperature among them; [`MediumSection::read`] checks them.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct MediumTable {
    speed_of_sound_m_s: Key<SoundSpeed>,
    temperature_c: Key<Finite>,
    humidity_percent: Key<Finite>,
    pressure_kpa: Key<Finite>,
}

impl Serialize for MediumTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for MediumTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = Self::deserialize(deserializer)?;
        match (&table.speed_of_sound_m_s, &table.temperature_c) {
            (None, None) => Err(D::Error::missing_field("temperature_c")),
            _ => Ok(table),
        }
    }
}

/// The medium, by its speed of sound or by the state of the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MediumSection {
    /// The speed of sound, metres per second.
    SpeedOfSound(SoundSpeed),
    /// Air, from which the speed of sound follows.
    Air {
        /// Temperature, °C, -20 to 50.
        temperature_c: Finite,
        /// Relative humidity, percent, 0 to 100.
        humidity_percent: Finite,
        /// Pressure, kPa, 60 to 110.
        pressure_kpa: Finite,
    },
}

impl MediumSection {
    /// Checks the `[medium]` of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at keys that exclude each other or are out of range, or naming those that are missing.
    pub fn read(table: &Spanned<MediumTable>, source: &TomlSource) -> Result<Self, Fault> {
        let keys = table.get_ref();
        if let Some(speed) = &keys.speed_of_sound_m_s {
            let section = Section::new(
                source,
                table.span(),
                "a medium given by its speed of sound",
                "`speed_of_sound_m_s` alone",
            );
            section.refuse("temperature_c", &keys.temperature_c)?;
            section.refuse("humidity_percent", &keys.humidity_percent)?;
            section.refuse("pressure_kpa", &keys.pressure_kpa)?;
            return Ok(Self::SpeedOfSound(*speed.get_ref()));
        }
        let section = Section::new(
            source,
            table.span(),
            "[medium] without `speed_of_sound_m_s`",
            "`temperature_c`, and where they are known `humidity_percent` and `pressure_kpa`",
        );
        let temperature_c = section.need("temperature_c", &keys.temperature_c)?;
        let or = |key: &Key<Finite>, usual: f64| {
            key.as_ref().map_or_else(|| literal(usual), |value| *value.get_ref())
        };
        let humidity_percent = or(&keys.humidity_percent, USUAL_HUMIDITY_PERCENT);
        let pressure_kpa = or(&keys.pressure_kpa, USUAL_PRESSURE_KPA);
        within(&keys.temperature_c, &TEMPERATURES_C, "°C", source)?;
        within(&keys.humidity_percent, &(0.0..=100.0), "percent", source)?;
        within(&keys.pressure_kpa, &PRESSURES_KPA, "kPa", source)?;
        Ok(Self::Air { temperature_c, humidity_percent, pressure_kpa })
    }

    /// Air in a measured state; `None` where the speed of sound in it cannot be computed.
    pub fn of_air(temperature_c: f64, humidity_percent: f64, pressure_kpa: f64) -> Option<Self> {
        let computable = TEMPERATURES_C.contains(&temperature_c)
            && (0.0..=100.0).contains(&humidity_percent)
            && PRESSURES_KPA.contains(&pressure_kpa);
        let finite = |value: f64| Finite::new(value).ok();
        computable.then_some(())?;
        Some(Self::Air {
            temperature_c: finite(temperature_c)?,
            humidity_percent: finite(humidity_percent)?,
            pressure_kpa: finite(pressure_kpa)?,
        })
    }

    /// The medium for the simulation.
    pub fn medium(&self) -> Medium {
        match *self {
            Self::SpeedOfSound(speed) => Medium { speed_of_sound_m_s: speed.get() },
            Self::Air { temperature_c, humidity_percent, pressure_kpa } => {
                Medium::air(temperature_c.get(), humidity_percent.get(), pressure_kpa.get())
            }
        }
    }

    /// The section for writing.
    pub fn table(&self) -> MediumTable {
        match *self {
            Self::SpeedOfSound(speed) => {
                MediumTable { speed_of_sound_m_s: written(speed), ..MediumTable::default() }
            }
            Self::Air { temperature_c, humidity_percent, pressure_kpa } => MediumTable {
                speed_of_sound_m_s: None,
                temperature_c: written(temperature_c),
                humidity_percent: written(humidity_percent),
                pressure_kpa: written(pressure_kpa),
            },
        }
    }
}

fn within(
    key: &Key<Finite>,
    range: &std::ops::RangeInclusive<f64>,
    unit: &str,
    source: &TomlSource,
) -> Result<(), Fault> {
    match key {
        Some(value) if !range.contains(&value.get_ref().get()) => Err(source.fault(
            value.span(),
            format!(
                "{} is outside the range of the formula for the speed of sound in air, {} to {} {unit}",
                value.get_ref().get(),
                range.start(),
                range.end()
            ),
            "correct the value, or give `speed_of_sound_m_s` instead",
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[derive(Deserialize)]
    struct File {
        medium: Spanned<MediumTable>,
    }

    fn read(text: &str) -> Result<MediumSection, Fault> {
        let source = TomlSource::new(Path::new("m.toml"), format!("[medium]\n{text}"));
        let file: File = source.parse()?;
        MediumSection::read(&file.medium, &source)
    }

    #[test]
    fn a_speed_of_sound_and_a_state_of_the_air_give_a_medium() {
        let medium = read("speed_of_sound_m_s = 343.0\n").expect("good").medium();
        assert_eq!(medium.speed_of_sound_m_s, 343.0);
        let air = "temperature_c = 20\nhumidity_percent = 0.0\npressure_kpa = 101.325\n";
        let medium = read(air).expect("good").medium();
        assert!((medium.speed_of_sound_m_s - 343.4).abs() < 0.2);
    }

    #[test]
    fn a_temperature_alone_is_that_of_a_usual_room() {
        let room = "temperature_c = 20.0\nhumidity_percent = 50.0\npressure_kpa = 101.325\n";
        assert_eq!(read("temperature_c = 20.0\n").expect("good"), read(room).expect("good"));
    }

    #[test]
    fn measured_air_is_a_medium_within_the_range_of_the_formula() {
        let air = MediumSection::of_air(20.0, 0.0, 101.325).expect("a room");
        assert!((air.medium().speed_of_sound_m_s - 343.4).abs() < 0.2);
        for (t, rh, p) in [(60.0, 50.0, 101.0), (20.0, 101.0, 101.0), (20.0, 50.0, 20.0)] {
            assert_eq!(MediumSection::of_air(t, rh, p), None);
        }
        assert_eq!(MediumSection::of_air(f64::NAN, 50.0, 101.0), None);
    }

    #[test]
    fn faults_are_placed() {
        let cases = [
            ("speed_of_sound_m_s = 343000.0\n", 2, "100 to 2000 m/s"),
            ("speed_of_sound_m_s = 343.0\npressure_kpa = 100.0\n", 3, "`pressure_kpa`"),
            ("temperature_c = 20.0\nhumidity_percent = 50.0\npressure_kpa = 1013.25\n", 4, "kPa"),
            ("temperature_c = 293.15\nhumidity_percent = 50.0\npressure_kpa = 101.0\n", 2, "°C"),
            ("temperature_c = 20.0\nhumidity_percent = 150\npressure_kpa = 101.0\n", 3, "percent"),
            ("", 1, "`temperature_c`"),
        ];
        for (text, line, said) in cases {
            let fault = read(text).expect_err(text);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{text}: {fault}");
            assert!(fault.problem().contains(said), "{text}: {fault}");
        }
    }
}
