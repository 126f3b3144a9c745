//! The driver rounds the delay to n steps in a period.
//!
//! Where in a step its zero lies depends on which delay the driver counts from, and is fitted.

use super::{Choice, Context, Effect, Fitted, Said, Search};
use crate::FittedParameter;
use crate::supposed::Supposed;

/// Steps in a period: every number up to here, and then, as far as steps are told from none, what clocks and counters have.
const EVERY_STEPS: u32 = 64;
const MOST_STEPS: u32 = 256;
const OFTEN: usize = 4;

/// The effect.
pub(super) struct PhaseQuantisation;

impl Effect for PhaseQuantisation {
    fn id(&self) -> &'static str {
        "phase-quantisation"
    }

    fn search(&self) -> Search {
        Search::Steps
    }

    fn suppose(
        &self,
        _values: &[f64],
        choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.steps = match choice {
            Choice::Steps(steps, zero) => Some((f64::from(*steps), f64::from(*zero) / 16.0)),
            Choice::None | Choice::Law(_) | Choice::Elements(_) => None,
        };
    }

    fn say(&self, _fitted: &[Fitted], choice: &Choice, _believed: &Context) -> Said {
        let steps = match choice {
            Choice::Steps(steps, _) => f64::from(*steps),
            Choice::None | Choice::Law(_) | Choice::Elements(_) => f64::NAN,
        };
        let sentence = format!("the driver rounds delays to {steps} steps in a period");
        let value = FittedParameter::Real { value: steps, standard_error: 0.0 };
        Said::new([("steps", value)], sentence)
    }
}

/// All steps in a period that are looked at, and the sixteenths of a step in which their zero may lie.
pub(crate) fn steps_and_zeros() -> impl Iterator<Item = (u32, u8)> {
    let often = (EVERY_STEPS..=MOST_STEPS).step_by(OFTEN).skip(1);
    (2..=EVERY_STEPS).chain(often).flat_map(|steps| (0..16).map(move |zero| (steps, zero)))
}
