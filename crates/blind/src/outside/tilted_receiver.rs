//! The receiver does not look straight down: its sensitivity falls off about an axis of its own.

use super::super::causes::Parameters;
use super::super::dice::Dice;
use super::super::laboratory::Laboratory;
use super::{Draw, Outside};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::effects::{Effect, Path};

pub(super) const NAME: &str = "tilted-receiver";

/// Loss at [`TiltedReceiver::half_angle_deg`] from the axis, dB.
const LOSS_DB: f64 = 6.0;

#[derive(Debug, Clone, Copy)]
struct TiltedReceiver {
    /// The direction of travel that it hears best, of unit length.
    axis: Vec3,
    half_angle_deg: f64,
}

/// Leaning by 15 to 35 degrees to any side; its lobe is then as narrow as the size wants it.
pub(super) fn draw(_: &Laboratory, dice: &mut Dice) -> Draw {
    let (lean_rad, towards_rad) = (dice.uniform(15.0, 35.0).to_radians(), dice.angle_rad());
    let axis = Vec3::new(
        lean_rad.sin() * towards_rad.cos(),
        lean_rad.sin() * towards_rad.sin(),
        lean_rad.cos(),
    );
    // The loss in dB goes with one over the square of the lobe's width.
    Draw::new(1.0, move |size| TiltedReceiver { axis, half_angle_deg: 25.0 / size.sqrt() })
}

impl Effect for TiltedReceiver {
    fn path(&self, path: &mut Path) {
        let off_axis_deg = path.direction().dot(&self.axis).clamp(-1.0, 1.0).acos().to_degrees();
        let loss_db = LOSS_DB * (off_axis_deg / self.half_angle_deg).powi(2);
        path.gain *= 10f64.powf(-loss_db / 20.0);
    }
}

impl Outside for TiltedReceiver {
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
    fn sound_along_the_axis_is_heard_best_and_six_decibels_are_lost_at_the_half_angle() {
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
