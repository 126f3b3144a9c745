//! One to three elements are wired in reverse: their amplitude has the opposite sign.

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
