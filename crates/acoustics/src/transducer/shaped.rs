//! Another transducer whose lobe has another shape.

use super::{OnAxis, Smooth, Transducer};
use crate::rayleigh::Patch;

/// Where the shape of a lobe is held, besides the axis, as sin² θ: at 45°.
const HELD: f64 = 0.5;

/// Another transducer with its directivity times exp((s² - 1/2) (a s² + b s⁴)), s = sin θ, for a lobe that no stretching makes. The factor
/// is one on the axis and at 45°, so that a width is told by the level there.
///
/// A face cut into patches keeps its own lobe.
pub struct Shaped<'t> {
    /// The transducer.
    pub transducer: &'t dyn Transducer,
    /// The factors a and b.
    pub shape: [f64; 2],
}

impl Transducer for Shaped<'_> {
    fn smooth(&self) -> Smooth {
        self.transducer.smooth()
    }

    fn on_axis(&self) -> OnAxis {
        self.transducer.on_axis()
    }

    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64 {
        let plain = self.transducer.directivity(theta_rad, face_radius_m, wavenumber_rad_m);
        let sine2 = theta_rad.sin().powi(2);
        let [a, b] = self.shape;
        plain * ((sine2 - HELD) * sine2 * (a + b * sine2)).exp()
    }

    fn corners_rad(&self) -> Vec<f64> {
        self.transducer.corners_rad()
    }

    fn patches(&self, face_radius_m: f64, wavenumber_rad_m: f64) -> Vec<Patch> {
        self.transducer.patches(face_radius_m, wavenumber_rad_m)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Piston;
    use super::*;

    #[test]
    fn the_axis_and_half_a_right_angle_are_held() {
        let level = |shape: [f64; 2], theta_rad: f64| {
            Shaped { transducer: &Piston, shape }.directivity(theta_rad, 4.5e-3, 732.7)
        };
        for theta_rad in [0.0, std::f64::consts::FRAC_PI_4] {
            let plain = Piston.directivity(theta_rad, 4.5e-3, 732.7);
            assert!((level([3.0, -2.0], theta_rad) - plain).abs() < 1e-14);
        }
        // At 60°, s² = 3/4: the exponent is 1/4 of 3/4 (a + 3/4 b).
        let theta_rad = std::f64::consts::FRAC_PI_3;
        let factor = level([3.0, -2.0], theta_rad) / level([0.0, 0.0], theta_rad);
        assert!((factor - (0.1875f64 * 1.5).exp()).abs() < 1e-12);
    }
}
