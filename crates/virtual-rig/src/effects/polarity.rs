//! Some elements are wired in reverse: their pressure has the opposite sign at every frequency.

use serde::Deserialize;

use super::{Effect, TrueArray, all_exist};
use crate::counter_rng::CounterRng;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Polarity {
    /// Their numbers, from 0.
    elements: Vec<usize>,
}

impl Effect for Polarity {
    fn check(&self, elements: usize) -> Result<(), String> {
        all_exist(&self.elements, elements)
    }

    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        for &n in &self.elements {
            array.elements[n].amplitude *= -1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_named_elements_have_the_opposite_sign() {
        let mut array = TrueArray::of_two();
        effect::<Polarity>("elements = [0]").array(&mut array, CounterRng::new(0));
        assert_eq!((array.elements[0].amplitude, array.elements[1].amplitude), (-1.0, 1.0));
    }
}
