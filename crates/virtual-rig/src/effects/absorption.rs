//! Attenuation along each path beyond spreading.
//!
//! exp(-α d) with α = db_per_m ln 10 / 20; ISO 9613-1 gives about 1.3 dB/m at 40 kHz, 20 °C, 50 % humidity.

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Absorption {
    /// Attenuation, dB a metre.
    db_per_m: Finite,
}

impl Effect for Absorption {
    fn path(&self, path: &mut Path) {
        path.gain *= 10f64.powf(-self.db_per_m.get() * path.distance_m() / 20.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn twenty_decibels_over_half_a_metre_leave_a_tenth() {
        let mut path = Path::straight(0, Vec3::zeros(), Vec3::new(0.3, 0.0, 0.4), 343.0);
        effect::<Absorption>("db_per_m = 40.0").path(&mut path);
        assert!((path.gain - 0.1).abs() < 1e-12);
    }
}
