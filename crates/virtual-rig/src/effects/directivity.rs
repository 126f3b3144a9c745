//! The main lobe is wider or narrower than modelled.
//!
//! The lobe of a piston is 2 J₁(x)/x with x = k a sin θ, so a smaller face has a wider lobe in the same ratio. Where the lobe does
//! not follow from the face, its angles are scaled.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Directivity {
    /// Width of the true lobe over the modelled one.
    width_ratio: Positive,
}

impl Effect for Directivity {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        array.lobe_stretch *= self.width_ratio.get();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_lobe_is_wider_by_the_ratio() {
        let mut array = TrueArray::of_two();
        effect::<Directivity>("width_ratio = 1.25").array(&mut array, CounterRng::new(0));
        assert!((array.lobe_stretch - 1.25).abs() < 1e-15);
    }
}
