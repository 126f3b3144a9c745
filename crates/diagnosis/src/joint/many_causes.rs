//! Sets of many effects, found by the joint fit, then fitted and scored as those of the stepwise search are.

use rayon::prelude::*;

use crate::effect_id::EffectId;
use crate::effects::catalogue;
use crate::fit::any::refined;
use crate::fit::joint_fit::{Fit, SEARCH, fit};
use crate::joint::widths::{asked_for, joins, relevant, restarted};
use crate::limits::{
    ANOTHER_EFFECT, JOINT_ROUNDS, READINGS_OF_A_SEARCH, UNQUESTIONED, WORTH_EXTENDING,
};
use crate::model::effect::{Context, Search};
use crate::model::observations::Observations;
use crate::selection::extension::Extension;
use crate::selection::scored_model::{ScoredModel, is_near};

/// The best set of many effects, where it is near the readings; its effects stand in the order of the gaps that they make.
///
/// The joint fit begins at the best set of few, and at the set-up as believed: the effects that a stepwise search chose first may not be
/// there.
pub(crate) fn of_many_causes(
    few: &ScoredModel,
    believed: &ScoredModel,
    observations: &Observations,
    context: &Context,
) -> Option<ScoredModel> {
    let some = observations.thinned(READINGS_OF_A_SEARCH);
    let starts = [&few.fit, &believed.fit];
    let found_from = |from: &Fit| ScoredModel::of(named(from, &some, context), &some);
    let mut best = best_of(starts.into_par_iter().map(found_from).collect())?;
    for _ in 0..JOINT_ROUNDS {
        if is_near(&best.fit, &some) {
            best = without_what_adds_nothing(best, &some, context);
        }
        let Some(next) = with_what_has_no_slope(&best, &some, context) else { break };
        // Beside it, others may be asked for that took up its part, or none.
        let again = found_from(&next.fit);
        best = if again.log_evidence > next.log_evidence { again } else { next };
    }
    if !is_near(&best.fit, &some) {
        return None;
    }
    let mut best =
        without_what_adds_nothing(on_all(best.fit, observations, context), observations, context);
    best.fit = by_size(best.fit, observations, context);
    is_near(&best.fit, observations).then_some(best)
}

/// The rivals of a set of many effects: those that explain the readings without one of its effects, and its parts that lack one.
pub(crate) fn rivals_of_many(
    set: &ScoredModel,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let some = observations.thinned(READINGS_OF_A_SEARCH);
    let mut rivals = one_less(set, observations, context);
    rivals.extend(with_others_in_place(set, &some, observations, context));
    rivals
}

fn best_of(sets: Vec<ScoredModel>) -> Option<ScoredModel> {
    sets.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
}

/// A set that was fitted to some readings, fitted to all.
fn on_all(fit: Fit, observations: &Observations, context: &Context) -> ScoredModel {
    ScoredModel::of(refined(fit, observations, context, SEARCH, &[]), observations)
}

/// What explains the readings without one of the effects of a set: all other effects may take its place. (One element's departure hardly can.)
fn with_others_in_place(
    set: &ScoredModel,
    some: &Observations,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let smooth = (0..set.fit.instances.len())
        .into_par_iter()
        .filter(|&number| set.fit.instances[number].effect.search() == Search::Smooth);
    let without = smooth.map(|number| {
        let excluded = set.fit.instances[number].effect.id();
        let others = EffectId::ALL.iter().copied();
        let others = others.filter(|id| *id != excluded && context.tries(*id)).collect();
        let context = Context { tried: Some(others), ..context.clone() };
        let found = named(&set.fit.without(number), some, &context);
        on_all(found, observations, &context)
    });
    without.collect()
}

/// The effects that a joint fit from there keeps, with priors as wide as a set of few has them.
fn named(from: &Fit, observations: &Observations, context: &Context) -> Fit {
    let joint = relevant(from, observations, context);
    let Some((kept, _)) = asked_for(&joint, ANOTHER_EFFECT) else { return joint };
    let mut start = restarted(&joint, &kept);
    for (instance, spread) in start.instances.iter().zip(&mut start.spreads) {
        if instance.effect.search() != Search::Random {
            *spread = f64::NAN;
        }
    }
    fit(observations, context, start, SEARCH)
}

/// The set with one more effect of those that are in no joint fit, if the evidence asks for it.
fn with_what_has_no_slope(
    set: &ScoredModel,
    observations: &Observations,
    context: &Context,
) -> Option<ScoredModel> {
    let others = catalogue().filter(|effect| !joins(*effect, observations, context));
    let others = others.map(|effect| effect.id()).filter(|id| context.tries(*id)).collect();
    let context = Context { tried: Some(others), ..context.clone() };
    let Extension { fitted, .. } =
        Extension::of(std::slice::from_ref(set), Vec::new(), true, observations, &context);
    best_of(fitted).filter(|next| next.log_evidence > set.log_evidence + WORTH_EXTENDING)
}

/// The set without the effects for which the evidence is against them, one after the other.
fn without_what_adds_nothing(
    mut best: ScoredModel,
    observations: &Observations,
    context: &Context,
) -> ScoredModel {
    loop {
        match best_of(one_less(&best, observations, context)) {
            Some(next) if next.log_evidence > best.log_evidence => best = next,
            _ => return best,
        }
    }
}

/// The sets that lack one effect of this one, each fitted again, but for effects that nobody would question.
fn one_less(set: &ScoredModel, observations: &Observations, context: &Context) -> Vec<ScoredModel> {
    let physical = (0..set.fit.instances.len()).into_par_iter().filter(|&number| {
        !set.fit.instances[number].effect.is_defect()
            && set.fit.nats_of(number).is_none_or(|nats| nats < UNQUESTIONED)
    });
    let less = physical.map(|number| on_all(set.fit.without(number), observations, context));
    less.collect()
}

/// The fit with its effects in the order of the gaps that each makes, the largest first.
fn by_size(fit: Fit, observations: &Observations, context: &Context) -> Fit {
    let whole = on_scale(&fit, observations, context);
    let gaps: Vec<f64> = (0..fit.instances.len())
        .into_par_iter()
        .map(|number| {
            let mut less = fit.without(number);
            let model = less.model(context);
            // Beside its own gain: a change of the level is no gap.
            less.nuisance = model.best_gain_beside(observations, &less.nuisance);
            let less = on_scale(&less, observations, context);
            whole.iter().zip(&less).map(|(one, other)| (one - other).powi(2)).sum()
        })
        .collect();
    let mut order: Vec<usize> = (0..gaps.len()).collect();
    order.sort_by(|a, b| gaps[*b].total_cmp(&gaps[*a]));
    fit.in_order(&order)
}

/// The readings that a fit expects, in standard deviations of the noise.
fn on_scale(fit: &Fit, observations: &Observations, context: &Context) -> Vec<f64> {
    let expected = fit.model(context).expected_readings(observations, &fit.nuisance);
    let scales = observations.scans.iter().flat_map(|scan| {
        std::iter::repeat_n(&scan.scale, scan.drives.iter().map(|d| d.readings.len()).sum())
    });
    expected.into_iter().zip(scales).map(|(reading, scale)| scale.of(reading)).collect()
}
