//! A defect of the simulator itself: adding the effect mends it, and nothing is fitted.

use super::{Choice, Context, Effect, Fitted, Said};
use crate::observations::Observations;
use crate::supposed::Supposed;
use fieldgap_acoustics::Simulator;

/// A defect that only the simulator as written has.
pub(super) struct Defect {
    pub id: &'static str,
    pub sentence: &'static str,
    pub mend: fn(&mut Supposed),
}

impl Effect for Defect {
    fn id(&self) -> &'static str {
        self.id
    }

    fn is_defect(&self) -> bool {
        true
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.first().believed.simulator == Simulator::AsWritten
    }

    fn suppose(&self, _: &[f64], _: &Choice, _: &Context, supposed: &mut Supposed) {
        (self.mend)(supposed);
    }

    fn say(&self, _: &[Fitted], _: &Choice, _: &Context) -> Said {
        Said::new([], self.sentence.to_owned())
    }
}
