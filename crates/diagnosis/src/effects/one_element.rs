//! Amplitude or phase of one element alone: between two records of one array, one element changes more often than all do.
//!
//! It is no effect of the catalogue of its own, but the special case of [`Random`] in which all departures but one are zero. It pays for
//! the choice of the element and for one number, and not for a spread over the whole array.

use fieldgap_acoustics::{Element, Simulator};

use super::element_gain::ELEMENT_GAIN;
use super::element_phase::ELEMENT_PHASE;
use super::random::Random;
use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, Stage, Timing, elements_listed,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// A departure of one element.
pub(crate) struct OneElement {
    of: &'static Random,
    parameters: &'static [Parameter],
    key: SetupKey,
}

/// Both, amplitude first.
pub(crate) static ONE_ELEMENT: [OneElement; 2] = [
    OneElement {
        of: &ELEMENT_GAIN,
        // Three times as loud is more than any driver gives.
        parameters: &[Parameter { neutral: 0.0, scale: 0.01, least: -1.2, most: 2.0 }],
        key: SetupKey::Amplitudes,
    },
    OneElement {
        of: &ELEMENT_PHASE,
        parameters: &[Parameter { neutral: 0.0, scale: 0.01, least: -3.2, most: 3.2 }],
        key: SetupKey::Phases,
    },
];

impl Effect for OneElement {
    fn id(&self) -> EffectId {
        self.of.id
    }

    fn parameters(&self) -> &'static [Parameter] {
        self.parameters
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: self.of.per_element,
            mimics: self.of.mimics,
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(self.key)
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        for &n in at.choice.elements() {
            (self.of.act)(at.values[0], &mut elements[n]);
        }
    }

    fn describe(&self, fitted: &[Estimate], choice: &Choice, _: &Context) -> Finding {
        let value = choice.elements().to_vec();
        let sentence = format!(
            "{}: {} by {:.3} ± {:.3}",
            self.of.departures,
            elements_listed(&value),
            fitted[0].value,
            fitted[0].error
        );
        let elements = FittedParameter::Elements { value };
        Finding::new([("departure", fitted[0].real()), ("elements", elements)], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::instance::Instance;

    #[test]
    fn only_the_chosen_element_changes() {
        let bench = Bench::new();
        let instance = Instance { effect: &ONE_ELEMENT[0], choice: Choice::Elements(vec![1]) };
        let at = Setting { values: &[-0.3], choice: &instance.choice, ..bench.at(&[]) };
        let mut elements = [Element::at(0.0, 0.0); 3];
        instance.effect.elements(at, &mut elements);
        assert_eq!(elements.map(|element| element.amplitude), [1.0, 0.7, 1.0]);
    }
}
