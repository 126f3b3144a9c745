//! The array's board is bowed: the elements' height changes with the square of their distance from the centre, and their
//! normals follow the slope.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::counter_rng::CounterRng;
use fieldgap_virtual_rig::effects::{Effect, TrueArray};

pub(super) const NAME: &str = "bowed-array";

/// Distance from the centre at which the sag is stated, m: about half the array's width.
const RIM_M: f64 = 30e-3;

#[derive(Debug, Clone, Copy)]
struct BowedArray {
    /// Height of the surface at [`RIM_M`], m; above zero the array is a bowl.
    rim_m: f64,
}

/// On a board of 60 mm a sag beyond 2 mm would be visible.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let sign = random.sign();
    Draw::new(2e-3, move |size| BowedArray { rim_m: sign * size })
}

impl Effect for BowedArray {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let curvature = 2.0 * self.rim_m / (RIM_M * RIM_M);
        for element in &mut array.elements {
            let across = Vec3::new(element.centre_m.x, element.centre_m.y, 0.0);
            element.centre_m.z += 0.5 * curvature * across.norm_squared();
            element.normal = (element.normal - curvature * across).normalize();
        }
    }
}

impl Unmodelled for BowedArray {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! { rim_mm = (self.rim_m * 1e3) }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Array;

    #[test]
    fn the_normals_point_to_the_centre_of_curvature() {
        let elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
        let mut array =
            TrueArray { channels: (0..elements.len()).collect(), elements, lobe_stretch: 1.0 };
        BowedArray { rim_m: 1e-3 }.array(&mut array, CounterRng::new(0));
        let centre_m = Vec3::z() * (RIM_M * RIM_M / 2e-3);
        for element in &array.elements {
            let towards = (centre_m - element.centre_m).normalize();
            assert!((towards - element.normal).norm() < 5e-3);
        }
    }
}
