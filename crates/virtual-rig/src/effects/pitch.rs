//! The array is larger or smaller than modelled: the elements' places, not their faces, scale about its centre.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Pitch {
    /// True over modelled.
    ratio: Positive,
}

impl Effect for Pitch {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        for element in &mut array.elements {
            element.centre_m *= self.ratio.get();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn distances_between_elements_scale() {
        let mut array = TrueArray::of_two();
        let distance = |a: &TrueArray| (a.elements[0].centre_m - a.elements[1].centre_m).norm();
        let before = distance(&array);
        effect::<Pitch>("ratio = 1.02").array(&mut array, CounterRng::new(0));
        assert!((distance(&array) / before - 1.02).abs() < 1e-12);
    }
}
