//! A transducer with wider or narrower lobes than another.

use super::{OnAxis, Smooth, Transducer};
use crate::rayleigh::Patch;

/// Another transducer with its directivity stretched in angle.
pub struct Widened<'t> {
    /// The transducer.
    pub transducer: &'t dyn Transducer,
    /// Width relative to the original lobes; above zero.
    pub ratio: f64,
    /// Whether the face is made smaller by the ratio, which stretches sin θ; otherwise θ itself is stretched.
    pub by_face: bool,
}

impl Transducer for Widened<'_> {
    fn smooth(&self) -> Smooth {
        match self.transducer.smooth() {
            // With θ stretched, the directivity is no longer a smooth function of sin² θ at a right angle.
            Smooth::InSineSquared if !self.by_face => Smooth::InCosine,
            smooth => smooth,
        }
    }

    fn on_axis(&self) -> OnAxis {
        self.transducer.on_axis()
    }

    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64 {
        if self.by_face {
            let face_radius_m = face_radius_m / self.ratio;
            return self.transducer.directivity(theta_rad, face_radius_m, wavenumber_rad_m);
        }
        let theta_rad = theta_rad / self.ratio;
        self.transducer.directivity(theta_rad, face_radius_m, wavenumber_rad_m)
    }

    fn corners_rad(&self) -> Vec<f64> {
        let stretched = self
            .transducer
            .corners_rad()
            .into_iter()
            .map(|corner_rad| if self.by_face { corner_rad } else { corner_rad * self.ratio });
        stretched.filter(|&corner_rad| corner_rad < std::f64::consts::FRAC_PI_2).collect()
    }

    fn patches(&self, face_radius_m: f64, wavenumber_rad_m: f64) -> Vec<Patch> {
        // The lobes of a face cut into patches are always stretched by making the face smaller.
        let smaller_m = face_radius_m / self.ratio;
        let mut patches = self.transducer.patches(smaller_m, wavenumber_rad_m);
        for patch in &mut patches {
            patch.u /= self.ratio;
            patch.v /= self.ratio;
        }
        patches
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MurataFit, Piston};
    use super::*;

    #[test]
    fn the_level_at_an_angle_is_found_at_the_stretched_angle() {
        let wide = Widened { transducer: &MurataFit::CENTIMETRES, ratio: 1.25, by_face: false };
        let level = MurataFit::CENTIMETRES.directivity(0.4, 4.5e-3, 732.7);
        assert!((wide.directivity(0.5, 4.5e-3, 732.7) - level).abs() < 1e-15);
        let smaller = Widened { transducer: &Piston, ratio: 1.25, by_face: true };
        let level = Piston.directivity(0.4, 4.5e-3, 732.7);
        let angle = (1.25 * 0.4f64.sin()).asin();
        assert!((smaller.directivity(angle, 4.5e-3, 732.7) - level).abs() < 1e-14);
    }
}
