//! The array's board is bowed: the elements' height changes with the square of their distance from the centre, and their
//! normals follow the slope.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BowedArray {
    /// Height of the outermost element over that of the centre; above zero the array is a bowl towards the field.
    sagitta_mm: Finite,
}

impl Effect for BowedArray {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let across_m = |at_m: &Vec3| at_m.xy().norm();
        let rim_m = array.elements.iter().map(|e| across_m(&e.centre_m)).fold(0.0, f64::max);
        if rim_m == 0.0 {
            return;
        }
        let curvature = 2.0 * self.sagitta_mm.get() * 1e-3 / (rim_m * rim_m);
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
    fn the_rim_rises_by_the_sagitta_and_the_normals_point_to_the_centre_of_curvature() {
        let elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
        let mut array =
            TrueArray { channels: (0..elements.len()).collect(), elements, lobe_stretch: 1.0 };
        effect::<BowedArray>("sagitta_mm = 1.0").array(&mut array, CounterRng::new(0));
        let rim_m = 26.25e-3 * 2f64.sqrt();
        assert!((array.elements[0].centre_m.z - 1e-3).abs() < 1e-12);
        let centre_m = Vec3::z() * (rim_m * rim_m / 2e-3);
        for element in &array.elements {
            let towards = (centre_m - element.centre_m).normalize();
            assert!((towards - element.normal).norm() < 5e-3);
        }
    }
}
