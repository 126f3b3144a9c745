//! A plane above the field, parallel to the array, returns an image of it.
//!
//! By the method of images (Pierce, *Acoustics*, section 1-4) the reflected field is that of the array mirrored at the plane,
//! times the plane's coefficient.

use num_complex::Complex64;
use serde::Deserialize;

use super::{Effect, Mirror};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite, Length};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reflection {
    /// Height of the plane above the array, mm.
    height_mm: Length,
    /// Reflection coefficient of pressure, real and imaginary part.
    coefficient: Exact<Finite, 2>,
}

impl Effect for Reflection {
    fn mirror(&self) -> Option<Mirror> {
        let [re, im] = self.coefficient.map(Finite::get);
        let coefficient = Complex64::new(re, im);
        let distance_m = self.height_mm.get() * 1e-3;
        Some(Mirror { normal: Vec3::z(), distance_m, coefficient, baffle: false })
    }
}

#[cfg(test)]
mod tests {
    use super::super::TrueArray;
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_image_is_as_far_behind_the_plane_and_faces_down() {
        let mirror = effect::<Reflection>("height_mm = 200.0\ncoefficient = [0.3, -0.1]")
            .mirror()
            .expect("a reflection has a mirror");
        let image = mirror.images(&TrueArray::of_two().elements[1]).next().expect("one");
        assert!((image.centre_m.z - 0.4).abs() < 1e-12 && image.normal.z == -1.0);
        assert_eq!(mirror.coefficient, Complex64::new(0.3, -0.1));
    }
}
