//! The search through sets of effects: every single one, then the best of them with each of the others, as long as the
//! evidence asks for more.

use rayon::prelude::*;

use super::effects::{CATALOGUE, Choice, Context, Effect, Search};
use super::evidence::{cost_of_freedom, log_evidence};
use super::fit::{Fit, Instance, Promise, Promises, SEARCH, Start, fit, is_plausible};
use super::observations::Observations;
use super::random_elements::{best_spread, fit_with_spread};
use super::search::{Scored, beginnings, extended};
use crate::least_squares::Stopping;

/// Readings on which effects are first looked for.
const COARSE: usize = 1300;

/// Nats behind the best, on all readings by the coarse fit's estimate, at which an effect is given up.
const HOPELESS: f64 = 80.0;

/// Sets that are fitted to all readings however far they are behind.
const KEPT_ANYWAY: usize = 5;

/// Sets that are extended by one effect more.
const EXTENDED: usize = 3;

/// Cost a reading up to which a fit is near the readings.
const NEAR: f64 = 1.5;

/// Nats that an effect must promise to be fitted beside what is near the readings already.
const LEAST_PROMISE: f64 = -1.0;

/// Elements up to which each may have an amplitude or a phase of its own, or be exchanged with any other: of more, the
/// readings of a scan do not tell.
const MOST_ELEMENTS: usize = 120;

/// Most effects in a set.
const MOST_EFFECTS: usize = 4;

/// Nats that a larger set must gain over the best of the smaller ones before it is extended in its turn.
const WORTH_MORE: f64 = 2.0;

/// Rounds in which effects of the best set are exchanged for others.
const MOST_EXCHANGES: usize = 3;

/// Share of the gap, in chi-square, that another effect must close: formulas are no better than that.
const MATERIAL: f64 = 3e-4;

/// Nats within which sets near the readings are rivals, and extended.
const RIVALS: f64 = 12.0;

/// Nats behind the best within which a set is fitted anew when the noise is judged anew.
const STILL_HOPEFUL: f64 = 40.0;

/// A set of effects as it was fitted, with the logarithm of its evidence.
#[derive(Clone)]
pub(super) struct Tried {
    pub fit: Fit,
    pub log_evidence: f64,
}

impl Tried {
    fn of(fit: Fit, observations: &Observations) -> Self {
        Self { log_evidence: log_evidence(&fit, observations), fit }
    }
}

/// The believed set-up with nothing added.
pub(super) fn believed(observations: &Observations, context: &Context) -> Tried {
    let start = Start { instances: vec![], values: vec![], spreads: vec![], nuisance: None };
    Tried::of(fit(observations, context, start, SEARCH), observations)
}

/// Everything that was tried, the best first.
pub(super) fn pursue(observations: &Observations, context: &Context) -> Vec<Tried> {
    let mut tried = vec![believed(observations, context)];
    let size = mend_simulator(&mut tried, observations, context);
    pursue_from(tried, size, observations, context)
}

/// The simulator's own defects come first: nobody looks for physics in what a slip of the program explains. Gives
/// the number of those that are taken in.
fn mend_simulator(tried: &mut Vec<Tried>, observations: &Observations, context: &Context) -> usize {
    let mut mended = tried[0].clone();
    loop {
        let ids = mended.fit.ids();
        let defects = CATALOGUE.into_iter().filter(|effect| {
            effect.is_defect() && effect.can_act(observations) && !ids.contains(&effect.id())
        });
        let one_more: Vec<Tried> = defects
            .map(|effect| {
                let mut values = mended.fit.values.clone();
                values.push(Vec::new());
                let mut spreads = mended.fit.spreads.clone();
                spreads.push(f64::NAN);
                let instances = extended(&mended.fit, effect, Choice::None);
                let start = Start { instances, values, spreads, nuisance: None };
                Tried::of(fit(observations, context, start, SEARCH), observations)
            })
            .collect();
        tried.extend(one_more.iter().cloned());
        let best = one_more.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
        match best.filter(|best| best.log_evidence > mended.log_evidence + WORTH_MORE) {
            Some(best) => mended = best,
            None => break,
        }
    }
    let size = mended.fit.instances.len();
    // What else was tried with as many would be searched on from as well.
    tried.retain(|tried| tried.fit.instances.len() < size || tried.fit.ids() == mended.fit.ids());
    size
}

/// The same after the noise was judged anew: what was hopeful is fitted anew, and the best goes on.
pub(super) fn pursue_again(
    tried: Vec<Tried>,
    observations: &Observations,
    context: &Context,
) -> Vec<Tried> {
    let best = best_log_evidence(&tried);
    let hopeful: Vec<Vec<&str>> = tried
        .iter()
        .filter(|tried| tried.log_evidence > best - STILL_HOPEFUL)
        .map(|tried| tried.fit.ids())
        .collect();
    // What went into a hopeful set may do without the rest of it: some effects only make up for a noise judged wrong.
    let mut again: Vec<Tried> = tried
        .into_par_iter()
        .filter(|tried| {
            let ids = tried.fit.ids();
            hopeful.iter().any(|hopeful| ids.iter().all(|id| hopeful.contains(id)))
        })
        .map(|tried| Tried::of(refined(tried.fit, observations, context), observations))
        .collect();
    sort(&mut again);
    let size = again[0].fit.instances.len();
    pursue_from(again, size, observations, context)
}

/// Goes on from the best sets of a size.
fn pursue_from(
    mut tried: Vec<Tried>,
    size: usize,
    observations: &Observations,
    context: &Context,
) -> Vec<Tried> {
    let coarse = observations.thinned(COARSE);
    let of_size = |tried: &Tried| tried.fit.instances.len() == size;
    let mut frontier: Vec<Tried> = tried.iter().filter(|t| of_size(t)).cloned().collect();
    let gap = tried.iter().map(|t| t.fit.cost).fold(0.0, f64::max) - observations.len() as f64;
    for _ in 0..MOST_EFFECTS {
        sort(&mut frontier);
        let near = frontier[0].fit.cost < NEAR * observations.len() as f64;
        let behind = if near { RIVALS } else { f64::INFINITY };
        let least = frontier[0].log_evidence - behind;
        frontier.truncate(EXTENDED);
        frontier.retain(|tried| tried.log_evidence >= least);
        let before = best_log_evidence(&tried);
        let cost_before = frontier[0].fit.cost;
        let known: Vec<Vec<&str>> = tried.iter().map(|tried| sorted_ids(&tried.fit)).collect();
        let mut grown = extend(&frontier, &known, observations, &coarse, context);
        tried.extend(grown.iter().cloned());
        sort(&mut grown);
        let goes_on = grown.first().is_some_and(|best| {
            best.log_evidence > before + WORTH_MORE && cost_before - best.fit.cost > MATERIAL * gap
        });
        if !goes_on {
            // What closes next to nothing of a large gap makes up for the formulas' own error.
            tried.retain(|tried| {
                let small = |other: &Tried| {
                    tried.log_evidence > other.log_evidence
                        && holds_all(&tried.fit, &other.fit)
                        && other.fit.cost - tried.fit.cost < MATERIAL * gap
                };
                !frontier.iter().any(small)
            });
            break;
        }
        frontier = grown;
    }
    sort(&mut tried);
    for _ in 0..MOST_EXCHANGES {
        let best = tried[0].fit.ids();
        exchange(&mut tried, &coarse, observations, context);
        if tried[0].fit.ids() == best {
            break;
        }
    }
    tried
}

/// Tries every other effect in the place of each of the best set: what was taken in first, as the best alone, need not be
/// part of the best together.
fn exchange(
    tried: &mut Vec<Tried>,
    coarse: &Observations,
    observations: &Observations,
    context: &Context,
) {
    let ids = tried[0].fit.ids();
    if ids.len() < 2 {
        return;
    }
    let without: Vec<Tried> = (0..ids.len())
        .filter(|&number| !tried[0].fit.instances[number].effect.is_defect())
        .map(|number| {
            let Fit { mut instances, mut values, mut spreads, nuisance, .. } = tried[0].fit.clone();
            instances.remove(number);
            values.remove(number);
            spreads.remove(number);
            let start = Start { instances, values, spreads, nuisance: Some(nuisance) };
            Tried::of(fit_any(observations, context, start, SEARCH), observations)
        })
        .collect();
    let known: Vec<Vec<&str>> = tried.iter().map(|tried| sorted_ids(&tried.fit)).collect();
    tried.extend(extend(&without, &known, observations, coarse, context));
    let left_out = without.into_iter().filter(|t| !known.contains(&sorted_ids(&t.fit)));
    tried.extend(left_out);
    sort(tried);
}

/// Whether a set holds all effects of another and more.
fn holds_all(larger: &Fit, smaller: &Fit) -> bool {
    let ids = larger.ids();
    ids.len() > smaller.instances.len() && smaller.ids().iter().all(|id| ids.contains(id))
}

fn sorted_ids(fit: &Fit) -> Vec<&'static str> {
    let mut ids = fit.ids();
    ids.sort_unstable();
    ids
}

fn best_log_evidence(tried: &[Tried]) -> f64 {
    tried.iter().map(|tried| tried.log_evidence).fold(f64::NEG_INFINITY, f64::max)
}

fn sort(tried: &mut [Tried]) {
    tried.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
}

/// Every set worth a fit that has one effect more than one of these.
fn extend(
    frontier: &[Tried],
    known: &[Vec<&str>],
    observations: &Observations,
    coarse: &Observations,
    context: &Context,
) -> Vec<Tried> {
    let mut sets: Vec<(usize, &'static dyn Effect)> = Vec::new();
    let mut seen: Vec<Vec<&str>> = known.to_vec();
    for (number, tried) in frontier.iter().enumerate() {
        let ids = tried.fit.ids();
        for effect in CATALOGUE {
            let mut set = ids.clone();
            set.push(effect.id());
            set.sort_unstable();
            let one_by_one = matches!(effect.search(), Search::Random | Search::Exchanges);
            if one_by_one && observations.elements() > MOST_ELEMENTS {
                continue;
            }
            if ids.contains(&effect.id()) || seen.contains(&set) || !effect.can_act(observations) {
                continue;
            }
            seen.push(set);
            sets.push((number, effect));
        }
    }
    let promises: Vec<Promises<'_>> =
        frontier.par_iter().map(|tried| Promises::of(observations, context, &tried.fit)).collect();
    let scored: Vec<Scored<'_>> =
        frontier.par_iter().map(|tried| Scored::of(&tried.fit, observations, context)).collect();
    let near: Vec<bool> =
        frontier.iter().map(|tried| tried.fit.cost < NEAR * observations.len() as f64).collect();
    let rough: Vec<(usize, Fit)> = sets
        .par_iter()
        .filter_map(|&(number, effect)| {
            let fit = &frontier[number].fit;
            // What the repeats do not ask for must not make up for what is not yet explained.
            if effect.id() == "turbulence" && !near[number] && !observations.are_turbulent() {
                return None;
            }
            // Far from the readings a slope says little, and every effect is followed to where it leads.
            let hopeless = near[number] && promised_nats(&promises[number], effect) < LEAST_PROMISE;
            let begun = match hopeless {
                true => None,
                false => coarse_fit(fit, &scored[number], effect, coarse, context),
            };
            begun.map(|fit| (number, fit))
        })
        .collect();
    // What a coarse fit gains it gains about as often more on all readings as these are more.
    let share = observations.len() as f64 / coarse.len() as f64;
    let estimates: Vec<f64> = rough
        .iter()
        .map(|(number, fit)| {
            let frontier = &frontier[*number];
            let coarse_before = cost_on(coarse, &frontier.fit, context);
            // Each number that is fitted gains one by chance, which is not gained as often.
            let by_chance = fit.values.last().map_or(0, Vec::len) as f64;
            0.5 * share * (coarse_before - fit.cost - by_chance) + frontier.log_evidence
        })
        .collect();
    let mut best_first = estimates.clone();
    best_first.sort_by(|a, b| b.total_cmp(a));
    // Far from the readings all but one are hopeless by far, and yet another may be what is right together with the next.
    let least = match best_first.get(KEPT_ANYWAY - 1).or(best_first.last()) {
        Some(kept_anyway) => kept_anyway.min(best_first[0] - HOPELESS),
        None => return Vec::new(),
    };
    rough
        .into_par_iter()
        .zip(estimates)
        .filter(|(_, estimate)| *estimate >= least)
        .map(|((_, fit), _)| Tried::of(refined(fit, observations, context), observations))
        .collect()
}

/// Nats of evidence that an effect promises to first order; infinite where its slope says nothing.
fn promised_nats(promises: &Promises<'_>, effect: &'static dyn Effect) -> f64 {
    match effect.search() {
        Search::Smooth if effect.begins_flat(promises.context) => f64::INFINITY,
        Search::Smooth => {
            let neutral: Vec<f64> = effect.parameters().iter().map(|p| p.neutral).collect();
            let Promise { downhill, curvature } = promises.of_effect(effect, &neutral);
            let count = downhill.len();
            let Some(cholesky) = curvature.cholesky() else { return f64::INFINITY };
            let gained = downhill.dot(&cholesky.solve(&downhill));
            0.5 * gained - cost_of_freedom(count, gained.sqrt())
        }
        Search::Random => {
            let neutral = vec![0.0; promises.observations.elements()];
            let Promise { downhill, curvature } = promises.of_effect(effect, &neutral);
            best_spread(curvature, &downhill).1
        }
        Search::Sets | Search::Exchanges | Search::Steps | Search::Heights => f64::INFINITY,
    }
}

fn cost_on(observations: &Observations, fit: &Fit, context: &Context) -> f64 {
    let supposed = fit.supposed(context);
    let pressures = super::likelihood::pressures(observations, &supposed, &fit.nuisance);
    supposed.residuals(observations, &pressures, &fit.nuisance).cost()
}

/// The best fit of an effect beside those of a fit, on few readings; `None` if nothing there promises to be worth it.
fn coarse_fit(
    before: &Fit,
    scored: &Scored<'_>,
    effect: &'static dyn Effect,
    coarse: &Observations,
    context: &Context,
) -> Option<Fit> {
    beginnings(effect, scored, context)
        .into_iter()
        .filter(|beginning| {
            let instance = Instance { effect, choice: beginning.choice.clone() };
            is_plausible(coarse, context, &instance, &beginning.values)
        })
        .map(|beginning| {
            let mut values = before.values.clone();
            values.push(beginning.values);
            let mut spreads = before.spreads.clone();
            spreads.push(f64::NAN);
            let instances = extended(before, effect, beginning.choice);
            let start =
                Start { instances, values, spreads, nuisance: Some(before.nuisance.clone()) };
            fit_any(coarse, context, start, SEARCH)
        })
        .max_by(|a, b| log_evidence(a, coarse).total_cmp(&log_evidence(b, coarse)))
}

/// The same set on all readings, from where the coarse fit ended.
fn refined(fit: Fit, observations: &Observations, context: &Context) -> Fit {
    let start = Start {
        instances: fit.instances,
        values: fit.values,
        spreads: fit.spreads,
        nuisance: Some(fit.nuisance),
    };
    fit_any(observations, context, start, SEARCH)
}

/// Fits a set, finding the spread of elements where one is random.
pub(super) fn fit_any(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
) -> Fit {
    let random =
        start.instances.iter().rposition(|instance| instance.effect.search() == Search::Random);
    match random {
        Some(number) => fit_with_spread(observations, context, start, number, stopping),
        None => fit(observations, context, start, stopping),
    }
}
