//! One to three elements, or up to a twelfth of a large array, are wired in reverse: their amplitude has the opposite sign.

use super::of_elements::{Act, OfElements};
use crate::effect_id::EffectId;
use crate::model::effect::Search;
use crate::remedy::SetupKey;

pub(crate) static POLARITY: OfElements = OfElements {
    id: EffectId::Polarity,
    search: Search::Sets,
    words: "wired in reverse",
    mimics: &[EffectId::ElementPhase],
    key: SetupKey::ReversedElements,
    act: Act::Amplitude(-1.0),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::amplitudes_with;

    #[test]
    fn a_reversed_element_changes_its_sign() {
        assert_eq!(amplitudes_with(&POLARITY, &[0, 2]), [-1.0, 1.0, -1.0]);
    }
}
