//! A plane wall beside the field returns an image of the array.
//!
//! By the method of images (Pierce, *Acoustics*, section 1-4) its wave at a point is the array's own at the mirrored point, times the wall's
//! coefficient. With a baffle the plane of the array reflects that wave once more.

use num_complex::Complex64;
use serde::Deserialize;

use super::{Effect, Mirror};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wall {
    /// Direction of the wall's normal, of any length but zero; written as a unit vector.
    normal: Exact<Finite, 3>,
    /// Distance of the wall from the array's centre along the normal.
    distance_mm: Finite,
    /// Reflected over incident pressure, real and imaginary part.
    coefficient: Exact<Finite, 2>,
    /// Whether the array's plane, which is rigid then, reflects the wall's wave once more.
    #[serde(default)]
    baffle: bool,
}

impl Effect for Wall {
    fn check(&self, _elements: usize) -> Result<(), String> {
        match self.normal().norm() > 0.0 {
            true => Ok(()),
            false => Err("its normal has no direction".to_owned()),
        }
    }

    fn mirror(&self) -> Option<Mirror> {
        let [re, im] = self.coefficient.map(Finite::get);
        Some(Mirror {
            normal: self.normal().try_normalize(0.0)?,
            distance_m: self.distance_mm.get() * 1e-3,
            coefficient: Complex64::new(re, im),
            baffle: self.baffle,
        })
    }
}

impl Wall {
    fn normal(&self) -> Vec3 {
        Vec3::from(self.normal.map(Finite::get))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Element;

    #[test]
    fn images_lie_as_far_behind_the_wall_and_behind_the_baffle() {
        let wall: Wall =
            effect("normal = [0.6, 0, 0.8]\ndistance_mm = 100\ncoefficient = [0.5, 0]");
        let element = Element::at(0.01, 0.02);
        let images: Vec<Element> = wall.mirror().expect("a wall").images(&element).collect();
        let [image] = images[..] else { panic!("one image") };
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let middle_m = 0.5 * (image.centre_m + element.centre_m);
        assert!((middle_m.dot(&normal) - 0.1).abs() < 1e-12);
        assert!((image.centre_m - element.centre_m).cross(&normal).norm() < 1e-12);
        assert!((image.normal.z - (1.0 - 2.0 * 0.64)).abs() < 1e-12);
        let baffled = Wall { baffle: true, ..wall };
        let images: Vec<Element> = baffled.mirror().expect("a wall").images(&element).collect();
        assert_eq!(images.len(), 2);
        assert_eq!(
            images[1].centre_m,
            images[0].centre_m.component_mul(&Vec3::new(1.0, 1.0, -1.0))
        );
    }

    #[test]
    fn a_wall_without_a_direction_is_refused() {
        let wall: Wall = effect("normal = [0, 0, 0]\ndistance_mm = 100\ncoefficient = [0.5, 0]");
        assert!(wall.check(36).is_err() && wall.mirror().is_none());
    }
}
