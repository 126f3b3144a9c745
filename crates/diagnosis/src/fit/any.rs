//! A fit of any set of effects. The spread of random elements is found where the set has them.

use fieldgap_acoustics::least_squares::Stopping;

use crate::fit::joint_fit::{Fit, SEARCH, Start, fit, fit_beside};
use crate::fit::random_elements::fit_with_spread;
use crate::fit::slopes::Slopes;
use crate::model::effect::{Context, Search};
use crate::model::observations::Observations;

/// First steps of a fit.
const FIRST_STEPS: Stopping = Stopping { iterations: 4, ..SEARCH };

/// The first steps of a fit, with the spreads of elements as they are: enough to see whether it comes near.
pub(crate) fn first_steps(start: Start, observations: &Observations, context: &Context) -> Fit {
    fit(observations, context, start, FIRST_STEPS)
}

/// The same set on other readings, from where a fit ended. For `known` see [`fit_beside`].
pub(crate) fn refined(
    fit: Fit,
    observations: &Observations,
    context: &Context,
    stopping: Stopping,
    known: Option<&Slopes>,
) -> Fit {
    fit_any(observations, context, fit.into(), stopping, known)
}

/// Fits a set, finding the spread of elements where one is random. For `known` see [`fit_beside`].
pub(crate) fn fit_any(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
    known: Option<&Slopes>,
) -> Fit {
    let random =
        start.instances.iter().rposition(|instance| instance.effect.search() == Search::Random);
    match random {
        Some(number) => fit_with_spread(observations, context, start, number, stopping, known),
        None => fit_beside(observations, context, start, stopping, known),
    }
}
