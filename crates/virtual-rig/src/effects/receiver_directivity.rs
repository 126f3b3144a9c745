//! Sensitivity falls with the angle of arrival, counted from the receiver's axis (it looks at the array, along -z).
//!
//! A Gaussian in the angle, -6 dB at the given one: the usual fit of data-sheet lobes.

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceiverDirectivity {
    /// Angle at which the sensitivity is halved (-6 dB), degrees.
    half_angle_deg: Positive,
}

impl Effect for ReceiverDirectivity {
    fn path(&self, path: &mut Path) {
        let off_axis_deg = path.direction().z.clamp(-1.0, 1.0).acos().to_degrees();
        path.gain *= 10f64.powf(-0.3 * (off_axis_deg / self.half_angle_deg.get()).powi(2));
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn the_level_is_six_decibels_down_at_the_given_angle() {
        let effect = effect::<ReceiverDirectivity>("half_angle_deg = 45.0");
        let gain = |to: Vec3| {
            let mut path = Path::straight(0, Vec3::zeros(), to, 343.0);
            effect.path(&mut path);
            20.0 * path.gain.log10()
        };
        assert!(gain(Vec3::z()).abs() < 1e-9);
        assert!((gain(Vec3::new(0.1, 0.0, 0.1)) + 6.0).abs() < 1e-9);
    }
}
