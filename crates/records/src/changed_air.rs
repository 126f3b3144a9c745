//! What a pressure owes to the state of the air: the medium a little warmer or wetter than stated.

use super::medium_section::MediumSection;
use fieldgap_acoustics::{Air, Medium};

/// The air where a medium is given by its speed of sound alone: that of a laboratory.
const USUAL: Air = Air { temperature_c: 20.0, humidity_percent: 50.0, pressure_kpa: 101.325 };

const ZERO_C_K: f64 = 273.15;

/// A medium whose air differs from the stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangedAir {
    /// The medium.
    pub medium: Medium,
    /// Attenuation of the amplitude at the frequency that was asked for, Np/m.
    pub attenuation_np_m: f64,
    /// Density over that of the stated air. A face that vibrates alike radiates a pressure in proportion to it.
    pub density_ratio: f64,
}

impl MediumSection {
    /// The stated state of the air; 20 °C, 50 % and 101.325 kPa where only a speed of sound is stated.
    pub fn air(&self) -> Air {
        match *self {
            Self::SpeedOfSound(_) => USUAL,
            Self::Air { temperature_c, humidity_percent, pressure_kpa } => Air {
                temperature_c: temperature_c.get(),
                humidity_percent: humidity_percent.get(),
                pressure_kpa: pressure_kpa.get(),
            },
        }
    }

    /// The medium with air that is warmer by a temperature (°C) and wetter by a relative humidity (percent) than stated, at a frequency
    /// (Hz). The humidity stays between 0 and 100 %.
    ///
    /// A stated speed of sound changes as that of air does. The density is that of an ideal gas; its change with humidity, 0.04 dB
    /// for 50 % at 20 °C, is left out.
    pub fn changed(&self, warmer_c: f64, wetter_percent: f64, frequency_hz: f64) -> ChangedAir {
        let stated = self.air();
        let changed = Air {
            temperature_c: stated.temperature_c + warmer_c,
            humidity_percent: (stated.humidity_percent + wetter_percent).clamp(0.0, 100.0),
            ..stated
        };
        let ratio = changed.medium().speed_of_sound_m_s / stated.medium().speed_of_sound_m_s;
        ChangedAir {
            medium: Medium { speed_of_sound_m_s: self.medium().speed_of_sound_m_s * ratio },
            attenuation_np_m: changed.attenuation_np_m(frequency_hz),
            density_ratio: (stated.temperature_c + ZERO_C_K) / (changed.temperature_c + ZERO_C_K),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::{SoundSpeed, literal};

    #[test]
    fn warmer_air_is_faster_and_thinner() {
        let stated = MediumSection::of_air(20.0, 50.0, 101.325).expect("a room");
        let unchanged = stated.changed(0.0, 0.0, 40e3);
        assert_eq!((unchanged.medium, unchanged.density_ratio), (stated.medium(), 1.0));
        assert!((unchanged.attenuation_np_m - 1.318 / 8.686).abs() < 1e-3, "{unchanged:?}");
        let warmer = stated.changed(5.0, 0.0, 40e3);
        // The speed of sound rises as the root of the absolute temperature, the density falls with it.
        let root = (298.15f64 / 293.15).sqrt();
        assert!(
            (warmer.medium.speed_of_sound_m_s / stated.medium().speed_of_sound_m_s / root - 1.0)
                .abs()
                < 2e-3
        );
        assert!((warmer.density_ratio * root * root - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_stated_speed_changes_as_that_of_air() {
        let stated = MediumSection::SpeedOfSound(literal::<SoundSpeed>(340.0));
        let warmer = stated.changed(1.0, 0.0, 40e3).medium.speed_of_sound_m_s;
        assert!((warmer - 340.0 - 0.6).abs() < 0.05, "{warmer}");
        assert_eq!(stated.changed(0.0, 80.0, 40e3).medium, stated.changed(0.0, 50.0, 40e3).medium);
    }
}
