//! The main lobe is wider or narrower than modelled.
//!
//! The lobe of a piston is 2 J₁(x)/x with x = k a sin θ: a face smaller by the ratio has a lobe wider by it.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::input::Positive;
use crate::virtual_rig::luck::Luck;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Directivity {
    /// Width of the true lobe over the modelled one.
    width_ratio: Positive,
}

impl Effect for Directivity {
    fn array(&self, array: &mut TrueArray, _luck: Luck) {
        for element in &mut array.elements {
            element.radius_m /= self.width_ratio.get();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn half_the_level_stands_at_a_sine_wider_by_the_ratio() {
        let mut array = TrueArray::of_two();
        let nominal_m = array.elements[0].radius_m;
        effect::<Directivity>("width_ratio = 1.25").array(&mut array, Luck::new(0));
        let k = 733.0;
        let lobe = |radius: f64, sine: f64| {
            crate::acoustics::rayleigh::far_field_directivity(k * radius * sine)
        };
        assert!(
            (lobe(array.elements[1].radius_m, 0.5 * 1.25) - lobe(nominal_m, 0.5)).abs() < 1e-12
        );
    }
}
