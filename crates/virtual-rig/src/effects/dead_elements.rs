//! Some elements are silent.

use serde::Deserialize;

use super::{Effect, TrueArray, all_exist};
use crate::counter_rng::CounterRng;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeadElements {
    /// Their numbers, from 0.
    elements: Vec<usize>,
}

impl Effect for DeadElements {
    fn check(&self, elements: usize) -> Result<(), String> {
        all_exist(&self.elements, elements)
    }

    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        for &n in &self.elements {
            array.elements[n].amplitude = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_named_elements_are_silent_and_no_other() {
        let mut array = TrueArray::of_two();
        let effect = effect::<DeadElements>("elements = [1]");
        effect.array(&mut array, CounterRng::new(0));
        assert_eq!((array.elements[0].amplitude, array.elements[1].amplitude), (1.0, 0.0));
        assert!(effect.check(2).is_ok() && effect.check(1).is_err());
    }
}
