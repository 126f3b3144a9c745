//! One to three elements, or up to a twelfth of a large array, are silent: their amplitude is zero.

use super::of_elements::{Act, OfElements};
use crate::effect_id::EffectId;
use crate::model::effect::Search;
use crate::remedy::SetupKey;

pub(crate) static DEAD_ELEMENTS: OfElements = OfElements {
    id: EffectId::DeadElements,
    search: Search::Sets,
    words: "silent",
    mimics: &[EffectId::ElementGain],
    key: SetupKey::SilentElements,
    act: Act::Amplitude(0.0),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::amplitudes_with;

    #[test]
    fn a_silent_element_has_no_amplitude_and_the_others_keep_theirs() {
        assert_eq!(amplitudes_with(&DEAD_ELEMENTS, &[1]), [1.0, 0.0, 1.0]);
    }
}
