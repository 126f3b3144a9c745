//! Amplitudes differ from element to element: the amplitude of element n is multiplied by 1 + gₙ, with normal gₙ.

use num_complex::Complex64;

use super::random::Random;
use crate::effect_id::EffectId;
use crate::model::effect::PerElement;
use crate::remedy::SetupKey;

pub(crate) static ELEMENT_GAIN: Random = Random {
    id: EffectId::ElementGain,
    per_element: PerElement::Amplitude,
    mimics: &[EffectId::DeadElements],
    key: SetupKey::Amplitudes,
    spread: "spread",
    departures: "departures",
    words: |spread, error| {
        format!(
            "amplitudes differ from element to element by {:.1} ± {:.1} %",
            100.0 * spread,
            100.0 * error
        )
    },
    act: |departure, element| element.amplitude *= 1.0 + departure,
    weight: |departure| Complex64::from(1.0 + departure),
};
