//! The receiver is tilted: its sensitivity falls off about an axis that is not vertical.

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite, Positive};

/// Loss at [`TiltedReceiver::half_angle_deg`] from the axis, dB.
const LOSS_DB: f64 = 6.0;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TiltedReceiver {
    /// The direction of travel at highest sensitivity, of unit length.
    axis: Exact<Finite, 3>,
    /// Angle from the axis at which 6 dB are lost.
    half_angle_deg: Positive,
}

impl Effect for TiltedReceiver {
    fn path(&self, path: &mut Path) {
        let axis = Vec3::from(self.axis.map(Finite::get));
        let off_axis_deg = path.direction().dot(&axis).clamp(-1.0, 1.0).acos().to_degrees();
        let loss_db = LOSS_DB * (off_axis_deg / self.half_angle_deg.get()).powi(2);
        path.gain *= 10f64.powf(-loss_db / 20.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_sensitivity_is_highest_on_the_axis_and_six_decibels_lower_at_the_half_angle() {
        // At 30 degrees from the vertical.
        let receiver: TiltedReceiver =
            effect("axis = [0.5, 0.0, 0.8660254037844386]\nhalf_angle_deg = 30.0");
        let gain = |to: Vec3| {
            let mut path = Path::straight(0, Vec3::zeros(), to, 343.0);
            receiver.path(&mut path);
            20.0 * path.gain.log10()
        };
        assert!(gain(Vec3::new(0.05, 0.0, 0.05 * 3f64.sqrt())).abs() < 1e-9);
        assert!((gain(Vec3::z()) + 6.0).abs() < 1e-9);
    }
}
