//! Effects that name elements: the elements are chosen, and nothing is fitted.

use fieldgap_acoustics::{Element, Simulator};

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Carrier, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search,
    Stage, Timing, elements_listed,
};
use crate::model::instance::Setting;
use crate::model::observations::Observations;
use crate::remedy::{Remedy, SetupKey};

/// Something that is wrong with some elements.
pub(crate) struct OfElements {
    pub id: EffectId,
    pub search: Search,
    /// What comes before the elements in a sentence.
    pub words: &'static str,
    pub mimics: &'static [EffectId],
    pub key: SetupKey,
    /// What it does to the elements, and to the phases that they are driven with.
    pub act: Act,
}

/// What is wrong with the elements that are named.
#[derive(Clone, Copy)]
pub(crate) enum Act {
    /// Their amplitudes are multiplied by this.
    Amplitude(f64),
    /// Their drives are exchanged.
    Exchange,
}

impl Effect for OfElements {
    fn id(&self) -> EffectId {
        self.id
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::Named,
            mimics: self.mimics,
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(self.key)
    }

    fn search(&self) -> Search {
        self.search
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.elements() > 1
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        if let Act::Amplitude(factor) = self.act {
            for &n in at.choice.elements() {
                elements[n].amplitude *= factor;
            }
        }
    }

    fn drive_phases(
        &self,
        at: Setting<'_>,
        _drive: usize,
        _carrier: &Carrier,
        phases_rad: &mut [f64],
    ) {
        if let (Act::Exchange, [a, b]) = (self.act, at.choice.elements()) {
            phases_rad.swap(*a, *b);
        }
    }

    fn describe(&self, _: &[Estimate], choice: &Choice, _: &Context) -> Finding {
        let value = choice.elements().to_vec();
        let sentence = format!("{}: {}", self.words, elements_listed(&value));
        Finding::new([("elements", FittedParameter::Elements { value })], sentence)
    }
}
