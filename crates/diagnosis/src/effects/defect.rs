//! A defect of the simulator itself: adding the effect mends it, and nothing is fitted.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Radiation, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Observations;
use crate::remedy::{Remedy, SetupKey};

/// A defect that only the simulator as written has.
pub(crate) struct Defect {
    pub id: EffectId,
    /// What is wrong, one sentence.
    pub sentence: &'static str,
    /// What a simulator without the defect does.
    pub mend: fn(&mut Radiation<'_>),
}

impl Effect for Defect {
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
            per_element: PerElement::No,
            mimics: &[],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::SimulatorModel)
    }

    fn is_defect(&self) -> bool {
        true
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.first().believed.simulator == Simulator::AsWritten
    }

    fn radiation(&self, _at: Setting<'_>, radiation: &mut Radiation<'_>) {
        (self.mend)(radiation);
    }

    fn describe(&self, _: &[Estimate], _: &Choice, _: &Context) -> Finding {
        Finding::new([], self.sentence.to_owned())
    }
}
