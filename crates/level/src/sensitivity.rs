//! The sensitivity of a receiver: what it reads at a sound pressure.
//!
//! A rig file has these keys in `[receiver]`, and so has the `scan.toml` of a record. Readings are proportional to the amplitude of the
//! carrier. Whether they are its root mean square or its peak is stated by `reads`.

use serde::{Deserialize, Serialize};

use super::response::{AngularResponse, NoResponse};
use fieldgap_input::{Finite, Gap, Length, NonNegative, Positive};

/// Which value of the carrier a reading is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reads {
    /// The root mean square.
    Rms,
    /// The peak amplitude.
    Peak,
}

/// The keys as a file has them. [`Sensitivity::of_keys`] checks them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensitivityKeys {
    /// Volts per pascal, at normal incidence and at the carrier's frequency.
    pub sensitivity_v_pa: Option<Positive>,
    /// The same in the unit of the readings, whatever it is, per pascal.
    pub sensitivity_reading_pa: Option<Positive>,
    /// Relative standard uncertainty of the sensitivity, percent.
    pub sensitivity_u_percent: Option<NonNegative>,
    /// Which value of the carrier a reading is.
    pub reads: Option<Reads>,
    /// Gain of an amplifier behind the receiver that the sensitivity does not contain, dB.
    pub amplifier_gain_db: Option<Finite>,
    /// Its standard uncertainty, dB.
    pub amplifier_u_db: Option<NonNegative>,
    /// Angles of incidence, degrees from the axis.
    pub response_angle_deg: Option<Vec<Finite>>,
    /// Response at these angles relative to the axis, dB.
    pub response_db: Option<Vec<Finite>>,
    /// Standard uncertainty of this response, dB.
    pub response_u_db: Option<NonNegative>,
    /// Radius of the receiver's face, mm; in place of a response over angle.
    pub face_radius_mm: Option<Length>,
    /// Its standard uncertainty, mm.
    pub face_radius_u_mm: Option<Gap>,
    /// Standard uncertainty of the direction of the receiver's axis, degrees.
    pub tilt_u_deg: Option<NonNegative>,
    /// Standard uncertainty of the receiver's place along each axis, mm.
    pub place_u_mm: Option<Gap>,
    /// Standard uncertainty of the temperature of the air, °C.
    pub temperature_u_c: Option<NonNegative>,
    /// Standard uncertainty of its relative humidity, percent.
    pub humidity_u_percent: Option<NonNegative>,
}

/// Why the keys are not a sensitivity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SensitivityError {
    /// Keys that need a sensitivity.
    #[error(
        "`{0}` needs `sensitivity_v_pa`, or `sensitivity_reading_pa` of a receiver that does not read volts"
    )]
    NoSensitivity(&'static str),
    /// Both.
    #[error("`sensitivity_v_pa` and `sensitivity_reading_pa` state the same twice; keep one")]
    Twice,
    /// A key that a sensitivity needs.
    #[error("a sensitivity needs `{key}`, {what}")]
    Missing {
        /// The key.
        key: &'static str,
        /// What it states.
        what: &'static str,
    },
    /// A key without the one that it belongs to.
    #[error("`{key}` belongs to `{of}`, which is missing")]
    Alone {
        /// The key.
        key: &'static str,
        /// The missing key.
        of: &'static str,
    },
    /// Two models of the directivity.
    #[error(
        "`response_db` contains the averaging over the receiver's face; keep it or `face_radius_mm`"
    )]
    ResponseAndFace,
    /// A relative uncertainty that is none.
    #[error("`{key}` is {value}, but at most {most} {unit} is accepted")]
    TooLarge {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// The largest value.
        most: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The lists of the response.
    #[error(transparent)]
    Response(#[from] NoResponse),
}

/// What the sensitivity is per pascal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Per {
    /// Volts.
    Volt(f64),
    /// The unit of the readings.
    Reading(f64),
}

/// A unit of readings that a sensitivity in volts does not know.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the readings are in `{0}`, and `sensitivity_v_pa` is for volts; state `sensitivity_reading_pa`, per pascal in the unit of the readings"
)]
pub struct NoSuchUnit(String);

/// Standard uncertainties beside that of the sensitivity; `None` where nobody stated one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uncertainties {
    /// Of the receiver's place along each axis, m.
    pub place_m: Option<f64>,
    /// Of the direction of its axis, rad.
    pub tilt_rad: Option<f64>,
    /// Of the air's temperature, °C.
    pub temperature_c: Option<f64>,
    /// Of its relative humidity, percent.
    pub humidity_percent: Option<f64>,
}

/// The sensitivity of a receiver with its uncertainties.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    keys: SensitivityKeys,
    per: Per,
    reads: Reads,
    response: Option<AngularResponse>,
}

/// Largest relative standard uncertainty, percent: beyond it, a level is not known to 6 dB, and the budget's linear terms do not hold.
const MOST_RELATIVE_PERCENT: f64 = 50.0;
/// Largest standard uncertainty in decibels, for the same reason.
const MOST_DB: f64 = 6.0;
/// Largest gain of an amplifier, dB.
const MOST_GAIN_DB: f64 = 200.0;

impl Sensitivity {
    /// Checks keys; `None` if none of them is there.
    ///
    /// # Errors
    /// [`SensitivityError`] for the first key that is missing, superfluous or out of range.
    pub fn of_keys(keys: SensitivityKeys) -> Result<Option<Self>, SensitivityError> {
        let per = match (keys.sensitivity_v_pa, keys.sensitivity_reading_pa) {
            (Some(_), Some(_)) => return Err(SensitivityError::Twice),
            (Some(volts), None) => Per::Volt(volts.get()),
            (None, Some(reading)) => Per::Reading(reading.get()),
            (None, None) => {
                return match keys.present().into_iter().find(|(_, present)| *present) {
                    Some((key, _)) => Err(SensitivityError::NoSensitivity(key)),
                    None => Ok(None),
                };
            }
        };
        let missing = |key, what| SensitivityError::Missing { key, what };
        let relative = keys.sensitivity_u_percent.ok_or(missing(
            "sensitivity_u_percent",
            "its relative standard uncertainty in percent",
        ))?;
        let reads = keys
            .reads
            .ok_or(missing("reads", "`rms` or `peak`: which value of the carrier a reading is"))?;
        let at_most = |key, value: Option<f64>, most, unit| match value {
            Some(value) if value.abs() > most => {
                Err(SensitivityError::TooLarge { key, value, most, unit })
            }
            _ => Ok(()),
        };
        at_most("sensitivity_u_percent", Some(relative.get()), MOST_RELATIVE_PERCENT, "percent")?;
        at_most("amplifier_gain_db", keys.amplifier_gain_db.map(Finite::get), MOST_GAIN_DB, "dB")?;
        for (key, value) in
            [("amplifier_u_db", keys.amplifier_u_db), ("response_u_db", keys.response_u_db)]
        {
            at_most(key, value.map(NonNegative::get), MOST_DB, "dB")?;
        }
        at_most("tilt_u_deg", keys.tilt_u_deg.map(NonNegative::get), 45.0, "degrees")?;
        at_most("temperature_u_c", keys.temperature_u_c.map(NonNegative::get), 20.0, "°C")?;
        at_most(
            "humidity_u_percent",
            keys.humidity_u_percent.map(NonNegative::get),
            50.0,
            "percent",
        )?;
        let alone = |key, of| Err(SensitivityError::Alone { key, of });
        let numbers = |list: &[Finite]| list.iter().map(|number| number.get()).collect();
        let response = match (&keys.response_angle_deg, &keys.response_db) {
            (Some(_), None) => return alone("response_angle_deg", "response_db"),
            (None, Some(_)) => return alone("response_db", "response_angle_deg"),
            (None, None) if keys.response_u_db.is_some() => {
                return alone("response_u_db", "response_db");
            }
            (None, None) => None,
            (Some(angles), Some(levels)) => {
                if keys.response_u_db.is_none() {
                    return Err(missing(
                        "response_u_db",
                        "the standard uncertainty of `response_db`",
                    ));
                }
                Some(AngularResponse::new(numbers(angles), numbers(levels))?)
            }
        };
        match (keys.face_radius_mm, keys.face_radius_u_mm) {
            (Some(_), _) if response.is_some() => return Err(SensitivityError::ResponseAndFace),
            (Some(_), None) => {
                return Err(missing(
                    "face_radius_u_mm",
                    "the standard uncertainty of `face_radius_mm`",
                ));
            }
            (None, Some(_)) => return alone("face_radius_u_mm", "face_radius_mm"),
            _ => {}
        }
        Ok(Some(Self { keys, per, reads, response }))
    }

    /// The keys, for writing.
    pub fn keys(&self) -> &SensitivityKeys {
        &self.keys
    }

    /// The sensitivity itself.
    pub fn per(&self) -> Per {
        self.per
    }

    /// Which value of the carrier a reading is.
    pub fn reads(&self) -> Reads {
        self.reads
    }

    /// The same, of a receiver that a robot places with a standard uncertainty, m, unless the file states one.
    #[must_use]
    pub fn placed_within(mut self, place_m: f64) -> Self {
        if self.keys.place_u_mm.is_none() {
            self.keys.place_u_mm = Gap::new(place_m * 1e3).ok();
        }
        self
    }

    /// Sound pressure per unit of a reading, Pa rms: of a plane wave along the receiver's axis.
    ///
    /// # Errors
    /// [`NoSuchUnit`] if the sensitivity is per volt and the unit of the readings is none of volts.
    pub fn rms_pa_of(&self, unit: &str) -> Result<f64, NoSuchUnit> {
        let readings_a_pa = match self.per {
            Per::Reading(readings) => readings,
            Per::Volt(volts) => {
                volts / volts_in(unit).ok_or_else(|| NoSuchUnit(unit.to_owned()))?
            }
        };
        let gain = 10f64.powf(self.keys.amplifier_gain_db.map_or(0.0, Finite::get) / 20.0);
        let rms = match self.reads {
            Reads::Rms => 1.0,
            Reads::Peak => std::f64::consts::FRAC_1_SQRT_2,
        };
        Ok(rms / (readings_a_pa * gain))
    }

    /// Relative standard uncertainty of the sensitivity.
    pub fn relative(&self) -> f64 {
        self.keys.sensitivity_u_percent.map_or(0.0, NonNegative::get) / 100.0
    }

    /// Standard uncertainty of the amplifier's gain, dB; `None` without an amplifier, or if nobody stated one.
    pub fn amplifier_db(&self) -> Option<f64> {
        self.keys.amplifier_u_db.map(NonNegative::get)
    }

    /// Whether there is an amplifier whose gain has no stated uncertainty.
    pub fn has_uncertain_amplifier(&self) -> bool {
        self.keys.amplifier_gain_db.is_some() && self.keys.amplifier_u_db.is_none()
    }

    /// The response over the angle of incidence, with its standard uncertainty, dB.
    pub fn response(&self) -> Option<(&AngularResponse, f64)> {
        self.response.as_ref().zip(self.keys.response_u_db.map(NonNegative::get))
    }

    /// Radius of the face with its standard uncertainty, m.
    pub fn face_m(&self) -> Option<[f64; 2]> {
        let (radius, uncertainty) = (self.keys.face_radius_mm?, self.keys.face_radius_u_mm?);
        Some([radius.get() * 1e-3, uncertainty.get() * 1e-3])
    }

    /// The other uncertainties.
    pub fn uncertainties(&self) -> Uncertainties {
        Uncertainties {
            place_m: self.keys.place_u_mm.map(|mm| mm.get() * 1e-3),
            tilt_rad: self.keys.tilt_u_deg.map(|deg| deg.get().to_radians()),
            temperature_c: self.keys.temperature_u_c.map(NonNegative::get),
            humidity_percent: self.keys.humidity_u_percent.map(NonNegative::get),
        }
    }
}

impl Per {
    /// A sensitivity in a unit of readings, per pascal: in volts if the unit is one of volts.
    pub fn of(readings_a_pa: f64, unit: &str) -> Self {
        match volts_in(unit) {
            Some(volts) => Self::Volt(readings_a_pa * volts),
            None => Self::Reading(readings_a_pa),
        }
    }

    /// Key and value, as a rig file has them.
    pub fn key(self) -> (&'static str, f64) {
        match self {
            Self::Volt(volts) => ("sensitivity_v_pa", volts),
            Self::Reading(readings) => ("sensitivity_reading_pa", readings),
        }
    }
}

/// Volts in one of a unit of voltage.
fn volts_in(unit: &str) -> Option<f64> {
    Some(match unit {
        "V" | "volt" | "volts" => 1.0,
        "mV" => 1e-3,
        "µV" | "μV" | "uV" => 1e-6,
        "kV" => 1e3,
        _ => return None,
    })
}

impl SensitivityKeys {
    /// The keys beside the sensitivity, and whether each is there.
    fn present(&self) -> [(&'static str, bool); 13] {
        [
            ("sensitivity_u_percent", self.sensitivity_u_percent.is_some()),
            ("reads", self.reads.is_some()),
            ("amplifier_gain_db", self.amplifier_gain_db.is_some()),
            ("amplifier_u_db", self.amplifier_u_db.is_some()),
            ("response_angle_deg", self.response_angle_deg.is_some()),
            ("response_db", self.response_db.is_some()),
            ("response_u_db", self.response_u_db.is_some()),
            ("face_radius_mm", self.face_radius_mm.is_some()),
            ("face_radius_u_mm", self.face_radius_u_mm.is_some()),
            ("tilt_u_deg", self.tilt_u_deg.is_some()),
            ("place_u_mm", self.place_u_mm.is_some()),
            ("temperature_u_c", self.temperature_u_c.is_some()),
            ("humidity_u_percent", self.humidity_u_percent.is_some()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LEAST: &str = "sensitivity_v_pa = 0.003\nsensitivity_u_percent = 5.0\nreads = \"rms\"\n";

    fn read(text: &str) -> Result<Option<Sensitivity>, SensitivityError> {
        Sensitivity::of_keys(toml::from_str(text).expect("keys"))
    }

    fn good(text: &str) -> Sensitivity {
        read(text).expect("good").expect("a sensitivity")
    }

    #[test]
    fn a_reading_in_volts_is_a_pressure() {
        let sensitivity = good(LEAST);
        let pa = |unit| sensitivity.rms_pa_of(unit).expect("volts");
        assert!((pa("V") - 1.0 / 0.003).abs() < 1e-9 && (pa("mV") - 1.0 / 3.0).abs() < 1e-12);
        assert!(sensitivity.rms_pa_of("count").is_err());
        let counts = LEAST.replace("sensitivity_v_pa = 0.003", "sensitivity_reading_pa = 12.0");
        assert!((good(&counts).rms_pa_of("count").expect("any unit") - 1.0 / 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_peak_is_the_root_of_two_above_the_root_mean_square() {
        let [rms, peak] = ["rms", "peak"]
            .map(|reads| good(&LEAST.replace("rms", reads)).rms_pa_of("V").expect("volts"));
        assert!((rms / peak - std::f64::consts::SQRT_2).abs() < 1e-12);
    }

    #[test]
    fn an_amplifier_is_taken_out() {
        let of = |text: &str| good(&format!("{LEAST}{text}"));
        let pa = |sensitivity: &Sensitivity| sensitivity.rms_pa_of("V").expect("volts");
        assert!((pa(&of("amplifier_gain_db = 20.0\n")) * 10.0 / pa(&of("")) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_robot_places_the_receiver_unless_the_file_knows_better() {
        let place_m = |text: &str| {
            let placed = good(&format!("{LEAST}{text}")).placed_within(1e-4);
            placed.uncertainties().place_m.expect("one of them")
        };
        assert!((place_m("") - 1e-4).abs() < 1e-12);
        assert!((place_m("place_u_mm = 0.3\n") - 3e-4).abs() < 1e-12);
    }

    #[test]
    fn keys_that_do_not_belong_together_are_refused() {
        assert_eq!(read(""), Ok(None));
        for (text, said) in [
            ("reads = \"rms\"\n".to_owned(), "`reads` needs `sensitivity_v_pa`"),
            (format!("{LEAST}sensitivity_reading_pa = 1.0\n"), "twice"),
            ("sensitivity_v_pa = 0.003\nreads = \"rms\"\n".to_owned(), "`sensitivity_u_percent`"),
            ("sensitivity_v_pa = 0.003\nsensitivity_u_percent = 5\n".to_owned(), "`rms` or `peak`"),
            (LEAST.replace("5.0", "60.0"), "at most 50 percent"),
            (
                format!("{LEAST}response_db = [0.0, -1.0]\n"),
                "`response_angle_deg`, which is missing",
            ),
            (
                format!("{LEAST}response_angle_deg = [0, 9]\nresponse_db = [0, -1]\n"),
                "`response_u_db`",
            ),
            (format!("{LEAST}face_radius_mm = 3.0\n"), "`face_radius_u_mm`"),
            (format!("{LEAST}response_u_db = 0.1\n"), "`response_db`, which is missing"),
            (
                format!(
                    "{LEAST}response_angle_deg = [0, 9]\nresponse_db = [0, -1]\nresponse_u_db = 0.1\nface_radius_mm = 3\nface_radius_u_mm = 0.1\n"
                ),
                "keep it or `face_radius_mm`",
            ),
        ] {
            let error = read(&text).expect_err(&text).to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
        assert!(toml::from_str::<SensitivityKeys>("sensitivity_mv_pa = 3.0\n").is_err());
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back_equal(
            volts in 1e-6..10.0f64, percent in 0.0..50.0f64, gain in -60.0..60.0f64, face in 0.1..20.0f64, tilt in 0.0..45.0f64,
        ) {
            let text = format!(
                "{}face_radius_mm = {face:?}\nface_radius_u_mm = 0.2\namplifier_gain_db = {gain:?}\ntilt_u_deg = {tilt:?}\n",
                LEAST.replace("0.003", &format!("{volts:?}")).replace("5.0", &format!("{percent:?}"))
            );
            let sensitivity = good(&text).placed_within(1e-4);
            let written = toml::to_string(sensitivity.keys()).expect("keys are TOML");
            prop_assert_eq!(good(&written), sensitivity);
        }
    }
}
