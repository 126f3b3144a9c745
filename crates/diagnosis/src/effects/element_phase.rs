//! Phases differ from element to element: the phase of element n is advanced by φₙ, with normal φₙ.

use num_complex::Complex64;

use super::random::Random;
use crate::effect_id::EffectId;
use crate::model::effect::PerElement;
use crate::remedy::SetupKey;

pub(crate) static ELEMENT_PHASE: Random = Random {
    id: EffectId::ElementPhase,
    per_element: PerElement::Phase,
    mimics: &[EffectId::PhaseQuantisation, EffectId::SwappedChannels],
    key: SetupKey::Phases,
    spread: "spread_rad",
    departures: "departures_rad",
    words: |spread, error| {
        format!("phases differ from element to element by {spread:.3} ± {error:.3} rad")
    },
    act: |departure, element| element.phase_rad += departure,
    weight: Complex64::cis,
};
