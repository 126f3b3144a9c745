//! The driver rounds the delay to n steps in a period.
//!
//! Where in a step its zero lies depends on which delay the driver counts from, and is fitted.

use super::{Choice, Context, Effect, Fitted, Said, Search};
use crate::gap::diagnosis::FittedParameter;
use crate::gap::diagnosis::supposed::Supposed;

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
