//! Two elements are exchanged: each is driven by the other's output.

use super::of_elements::{Act, OfElements};
use crate::effect_id::EffectId;
use crate::model::effect::Search;
use crate::remedy::SetupKey;

pub(crate) static SWAPPED_CHANNELS: OfElements = OfElements {
    id: EffectId::SwappedChannels,
    search: Search::Exchanges,
    words: "driven by each other's outputs",
    mimics: &[EffectId::ElementPhase],
    key: SetupKey::SwappedElements,
    act: Act::Exchange,
};
