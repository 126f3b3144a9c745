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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::effect::Effect;
    use fieldgap_acoustics::Element;

    #[test]
    fn a_departure_advances_the_phase_as_its_weight_says() {
        let bench = Bench::new();
        let mut elements = [Element::at(0.0, 0.0); 2];
        ELEMENT_PHASE.elements(bench.at(&[0.1, -0.2]), &mut elements);
        assert_eq!(elements.map(|element| element.phase_rad), [0.1, -0.2]);
        assert!((ELEMENT_PHASE.element_weight(0.1) - Complex64::cis(0.1)).norm() < 1e-15);
    }
}
