//! The receiver is tilted: its sensitivity falls off about an axis that is not vertical.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::effects::{Effect, Path};

pub(super) const NAME: &str = "tilted-receiver";

/// Loss at [`TiltedReceiver::half_angle_deg`] from the axis, dB.
const LOSS_DB: f64 = 6.0;

#[derive(Debug, Clone, Copy)]
struct TiltedReceiver {
    /// The direction of travel at highest sensitivity, of unit length.
    axis: Vec3,
    half_angle_deg: f64,
}

/// Tilted by 15 to 35 degrees in a random direction. The size sets the width of its lobe.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (tilt_rad, azimuth_rad) = (random.uniform(15.0, 35.0).to_radians(), random.angle_rad());
    let axis = Vec3::new(
        tilt_rad.sin() * azimuth_rad.cos(),
        tilt_rad.sin() * azimuth_rad.sin(),
        tilt_rad.cos(),
    );
    // The loss in dB is inversely proportional to the square of the lobe's width.
    Draw::new(1.0, move |size| TiltedReceiver { axis, half_angle_deg: 25.0 / size.sqrt() })
}

impl Effect for TiltedReceiver {
    fn path(&self, path: &mut Path) {
        let off_axis_deg = path.direction().dot(&self.axis).clamp(-1.0, 1.0).acos().to_degrees();
        let loss_db = LOSS_DB * (off_axis_deg / self.half_angle_deg).powi(2);
        path.gain *= 10f64.powf(-loss_db / 20.0);
    }
}

impl Unmodelled for TiltedReceiver {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let axis = self.axis;
        toml::toml! {
            axis = [(axis.x), (axis.y), (axis.z)]
            half_angle_deg = (self.half_angle_deg)
        }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sensitivity_is_highest_on_the_axis_and_six_decibels_lower_at_the_half_angle() {
        let axis = Vec3::new(0.5, 0.0, 0.75f64.sqrt());
        let receiver = TiltedReceiver { axis, half_angle_deg: 30.0 };
        let gain = |to: Vec3| {
            let mut path = Path::straight(0, Vec3::zeros(), to, 343.0);
            receiver.path(&mut path);
            20.0 * path.gain.log10()
        };
        assert!(gain(axis * 0.1).abs() < 1e-9);
        assert!((gain(Vec3::z()) + 6.0).abs() < 1e-9);
    }
}
