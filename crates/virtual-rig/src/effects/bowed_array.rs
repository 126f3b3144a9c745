//! The array's board is bowed: the elements' height changes with the square of their distance from the centre, and their
//! normals follow the slope.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Distance from the centre at which the sag is stated, m: about half the array's width.
const RIM_M: f64 = 30e-3;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BowedArray {
    /// Height of the surface at [`RIM_M`]; above zero the array is a bowl.
    rim_mm: Finite,
}

impl Effect for BowedArray {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let curvature = 2.0 * self.rim_mm.get() * 1e-3 / (RIM_M * RIM_M);
        for element in &mut array.elements {
            let across = Vec3::new(element.centre_m.x, element.centre_m.y, 0.0);
            element.centre_m.z += 0.5 * curvature * across.norm_squared();
            element.normal = (element.normal - curvature * across).normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn the_normals_point_to_the_centre_of_curvature() {
        let elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
        let mut array =
            TrueArray { channels: (0..elements.len()).collect(), elements, lobe_stretch: 1.0 };
        effect::<BowedArray>("rim_mm = 1.0").array(&mut array, CounterRng::new(0));
        let centre_m = Vec3::z() * (RIM_M * RIM_M / 2e-3);
        for element in &array.elements {
            let towards = (centre_m - element.centre_m).normalize();
            assert!((towards - element.normal).norm() < 5e-3);
        }
    }
}
