//! The fit of all effects at once, with the widths of their priors.

use fieldgap_acoustics::least_squares::Stopping;

use crate::effects::catalogue;
use crate::fit::joint_fit::{Fit, Start, fit};
use crate::joint::posterior::{Member, Posterior, Said, unit_of_spread};
use crate::limits::{FIRST_WIDTH, ROUNDS_OF_WIDTHS};
use crate::model::effect::{Context, Effect, Search};
use crate::model::instance::Instance;
use crate::model::observations::Observations;

/// When the fit of a round stops: the widths change after it.
const ROUND: Stopping = Stopping { iterations: 8, step: 5e-2, fall: 1e-4, carried: 2 };

/// Relative change of a width below which it is settled.
const SETTLED: f64 = 0.1;

/// Every effect with a slope beside those of a fit, with priors of the widths for which the evidence is greatest. What the readings do not ask for has left the fit.
pub(crate) fn relevant(from: &Fit, observations: &Observations, context: &Context) -> Fit {
    let joins = |effect| joins(effect, observations, context);
    let mut start = with_priors(all_beside(from, observations, context, joins), context);
    let mut fitted = fit(observations, context, start.clone(), ROUND);
    for _ in 0..ROUNDS_OF_WIDTHS {
        let Some((kept, settled)) = asked_for(&fitted, 0.0) else { break };
        let removed = kept.len() < fitted.instances.len();
        start = restarted(&fitted, &kept);
        fitted = fit(observations, context, start, ROUND);
        if settled && !removed {
            break;
        }
    }
    fitted
}

/// The effects of a fit that the readings ask for by so many nats each, all weaker ones gone, with their widths, in the order of the fit; and whether
/// all widths are nearly those of the fit. `None` where its covariance is not known.
pub(crate) fn asked_for(fitted: &Fit, nats: f64) -> Option<(Vec<(usize, f64)>, bool)> {
    let mut posterior = Posterior::of(fitted)?;
    while let Some((weakest, said)) = posterior.weakest() {
        if said.nats > nats {
            break;
        }
        posterior = posterior.without(weakest)?;
    }
    let said = |number: usize| -> Option<Said> {
        let is_it = |member: &&Member| member.number == number;
        posterior.said(posterior.members().iter().find(is_it)?)
    };
    let mut settled = true;
    let mut kept = Vec::new();
    for (number, instance) in fitted.instances.iter().enumerate() {
        if !fitted.spreads[number].is_finite() {
            kept.push((number, f64::NAN));
        } else if let Some(Said { width, .. }) = said(number) {
            let spread = width * unit_of_spread(instance);
            settled &= (spread / fitted.spreads[number] - 1.0).abs() < SETTLED;
            kept.push((number, spread));
        }
    }
    Some((kept, settled))
}

/// These effects of a fit, from where it ended, with these spreads.
pub(crate) fn restarted(fitted: &Fit, kept: &[(usize, f64)]) -> Start {
    Start {
        instances: kept.iter().map(|(n, _)| fitted.instances[*n].clone()).collect(),
        values: kept.iter().map(|(n, _)| fitted.values[*n].clone()).collect(),
        spreads: kept.iter().map(|(_, spread)| *spread).collect(),
        nuisance: Some(fitted.nuisance.clone()),
    }
}

/// The effects of a fit, as they were fitted, and every other one of a kind, where it does nothing; these without priors.
pub(crate) fn all_beside(
    from: &Fit,
    observations: &Observations,
    context: &Context,
    is_of_kind: impl Fn(&'static dyn Effect) -> bool,
) -> Start {
    let elements = observations.elements();
    let Fit { mut instances, mut values, mut spreads, nuisance, .. } = from.clone();
    let held = from.ids();
    for effect in catalogue() {
        let tried = context.tries(effect.id()) && effect.can_act(observations);
        if !tried || !is_of_kind(effect) || held.contains(&effect.id()) {
            continue;
        }
        let choice = effect.choices().remove(0);
        let random = effect.search() == Search::Random;
        values.push(if random { effect.no_departures(elements) } else { effect.neutral() });
        spreads.push(if random { FIRST_SPREAD } else { f64::NAN });
        instances.push(Instance { effect, choice });
    }
    Start { instances, values, spreads, nuisance: Some(nuisance) }
}

/// The same with a prior of each effect. What was chosen, and planes whose place is far from where they do nothing, have none.
fn with_priors(mut start: Start, context: &Context) -> Start {
    for (instance, spread) in start.instances.iter().zip(&mut start.spreads) {
        if instance.effect.search() == Search::Smooth && !instance.effect.begins_flat(context) {
            *spread = FIRST_WIDTH;
        }
    }
    start
}

/// Whether an effect is in a joint fit from the beginning: it has a slope where it does nothing.
pub(crate) fn joins(
    effect: &'static dyn Effect,
    observations: &Observations,
    context: &Context,
) -> bool {
    match effect.search() {
        Search::Smooth => {
            !effect.begins_flat(context) && !effect.scatters_repeats() && !effect.is_defect()
        }
        Search::Random => observations.tell_each_element(),
        _ => false,
    }
}

/// Spread of elements' departures to begin with: arrays have five to ten percent, and as many degrees.
const FIRST_SPREAD: f64 = 0.1;
