//! A vertical wall beside the field reflects an image of the array.
//!
//! The image's field is the array's own at the mirrored point (Pierce, *Acoustics*, section 1-4).

use num_complex::Complex64;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "side-wall";

#[derive(Debug, Clone, Copy)]
struct SideWall {
    /// Its position on the x axis, m.
    x_m: f64,
    coefficient: Complex64,
}

/// Outside the planes on either side, up to 12 cm from the axis.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let x_m = random.sign() * random.uniform(45e-3, 120e-3);
    let angle_rad = random.angle_rad();
    Draw::new(1.0, move |size| SideWall {
        x_m,
        coefficient: Complex64::from_polar(size, angle_rad),
    })
}

impl Unmodelled for SideWall {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let coefficient = self.coefficient;
        toml::toml! {
            x_mm = (self.x_m * 1e3)
            coefficient = [(coefficient.re), (coefficient.im)]
        }
    }

    fn echoes(&self, at_m: Vec3, _wavenumber_rad_m: f64) -> Vec<(Vec3, Complex64)> {
        vec![(Vec3::new(2.0 * self.x_m - at_m.x, at_m.y, at_m.z), self.coefficient)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_the_wall_the_image_point_is_the_point_itself() {
        let wall = SideWall { x_m: 0.06, coefficient: Complex64::new(0.5, 0.0) };
        let at_m = Vec3::new(0.06, 0.01, 0.1);
        assert_eq!(wall.echoes(at_m, 733.0), [(at_m, Complex64::new(0.5, 0.0))]);
        let aside = wall.echoes(Vec3::new(0.02, 0.01, 0.1), 733.0)[0].0;
        assert!((aside - Vec3::new(0.1, 0.01, 0.1)).norm() < 1e-15);
    }
}
