//! Two elements hang on each other's outputs.

use serde::Deserialize;

use super::{Effect, TrueArray, all_exist};
use crate::luck::Luck;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SwappedChannels {
    /// Their numbers, from 0.
    elements: [usize; 2],
}

impl Effect for SwappedChannels {
    fn check(&self, elements: usize) -> Result<(), String> {
        all_exist(&self.elements, elements)
    }

    fn array(&self, array: &mut TrueArray, _luck: Luck) {
        let [a, b] = self.elements;
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
        effect::<SwappedChannels>("elements = [0, 1]").array(&mut array, Luck::new(0));
        assert_eq!(array.channels, [1, 0]);
    }
}
