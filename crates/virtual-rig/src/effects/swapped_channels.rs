//! Two elements are wired to each other's outputs.

use serde::Deserialize;

use super::{Effect, TrueArray, all_exist};
use crate::counter_rng::CounterRng;
use fieldgap_input::Exact;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SwappedChannels {
    /// Their numbers, from 0.
    elements: Exact<usize, 2>,
}

impl Effect for SwappedChannels {
    fn check(&self, elements: usize) -> Result<(), String> {
        all_exist(&*self.elements, elements)
    }

    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let [a, b] = *self.elements;
        array.channels.swap(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn each_element_follows_the_others_channel() {
        let mut array = TrueArray::of_two();
        effect::<SwappedChannels>("elements = [0, 1]").array(&mut array, CounterRng::new(0));
        assert_eq!(array.channels, [1, 0]);
    }
}
