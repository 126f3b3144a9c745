//! One to three elements are silent: their amplitude is zero.

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
