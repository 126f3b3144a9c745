//! The speed of sound in air differs from the assumed one.
//!
//! The delays sent to the array were computed for the assumed speed; sound travels at this one.

use serde::Deserialize;

use super::Effect;
use fieldgap_acoustics::Medium;
use fieldgap_input::SoundSpeed as Speed;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SoundSpeed {
    /// True speed of sound, m/s.
    c_m_s: Speed,
}

impl Effect for SoundSpeed {
    fn medium(&self, medium: &mut Medium) {
        medium.speed_of_sound_m_s = self.c_m_s.get();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_air_has_the_given_speed() {
        let mut medium = Medium { speed_of_sound_m_s: 343.0 };
        effect::<SoundSpeed>("c_m_s = 347.1").medium(&mut medium);
        assert_eq!(medium.speed_of_sound_m_s, 347.1);
    }
}
