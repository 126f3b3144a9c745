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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::effect::Effect;
    use fieldgap_acoustics::Element;

    #[test]
    fn a_departure_multiplies_the_amplitude_as_its_weight_says() {
        let bench = Bench::new();
        let mut elements = [Element::at(0.0, 0.0); 2];
        ELEMENT_GAIN.elements(bench.at(&[0.1, -0.2]), &mut elements);
        assert_eq!(elements.map(|element| element.amplitude), [1.1, 0.8]);
        assert_eq!(ELEMENT_GAIN.element_weight(0.1), Complex64::from(1.1));
    }
}
