//! Sets of effects, each extended by every effect that it does not hold yet.

use fieldgap_acoustics::least_squares::Stopping;
use rayon::iter::Either;
use rayon::prelude::*;

use crate::effect_id::EffectId;
use crate::effects::catalogue;
use crate::fit::any::{fit_any, refined};
use crate::fit::joint_fit::{Fit, SEARCH, Start, cost_on, fit_beside};
use crate::fit::outstanding_elements::in_place_of_departures;
use crate::fit::problem::is_plausible;
use crate::fit::random_elements::{best_spread, without_phases};
use crate::fit::score_statistic::{ScoreStatistic, ScoreStatistics};
use crate::fit::slopes::Slopes;
use crate::limits::{
    CARRIED, COARSE_READINGS_NEAR, FEW_READINGS, FEWEST_READINGS_NEAR, GIVEN_UP, KEPT_IN_ANY_CASE,
    LEAST_EXPECTED_NATS, MOST_ELEMENTS_OF_ONE_SET, ONE_STEP_SHORT_BY, RIVALS,
};
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::instance::Instance;
use crate::model::observations::Observations;
use crate::selection::evidence::{
    cost_of_freedom, cost_of_one_more, log_evidence, nats_of_unknown_noise,
};
use crate::selection::quick_scores::QuickScores;
use crate::selection::scored_model::{ScoredModel, is_near, sorted_ids};
use crate::selection::starts::{Beginning, beginnings, extended};

/// When a fit to few readings stops, and when the first fit from one of several starts stops.
const ROUGH: Stopping = Stopping { iterations: 12, step: 5e-2, fall: 1e-4, carried: CARRIED };
const FIRST_STEPS: Stopping = Stopping { iterations: 4, ..ROUGH };

/// A single step on all readings.
const ONE_STEP: Stopping = Stopping { iterations: 2, ..SEARCH };

/// The result of extending sets.
pub(crate) struct Extension {
    /// Fitted to all readings.
    pub fitted: Vec<ScoredModel>,
    /// Sorted ids of the sets that were rejected.
    pub given_up: Vec<Vec<EffectId>>,
    /// Sets whose further effect these readings cannot show.
    pub unseen: Vec<Unseen>,
}

/// A set of which the readings cannot show one effect: by their slopes it gains less than its parameters cost.
#[derive(Debug, Clone)]
pub(crate) struct Unseen {
    /// Sorted ids of the other effects.
    pub of: Vec<EffectId>,
    /// Evidence over that of the others alone, nats.
    pub nats: f64,
}

/// One set extended by one effect.
struct Extended {
    /// Number of the set in the frontier.
    number: usize,
    effect: &'static dyn Effect,
    ids: Vec<EffectId>,
}

impl Extension {
    /// Extends each set of the frontier by every effect, except to sets that are known already. Walls and objects, which take long, are looked for beside the
    /// set-up as believed, and beside the best set if it is near the readings.
    pub fn of(
        frontier: &[ScoredModel],
        known: Vec<Vec<EffectId>>,
        noise_is_settled: bool,
        observations: &Observations,
        context: &Context,
    ) -> Self {
        let asks = |number: usize, base: &Base<'_>| {
            number == 0 && (base.near || base.scored.fit.instances.is_empty())
        };
        Self::asking(asks, frontier, known, noise_is_settled, observations, context)
    }

    /// Extends a set by walls and objects alone.
    pub fn by_stray_waves(
        set: &ScoredModel,
        known: Vec<Vec<EffectId>>,
        noise_is_settled: bool,
        observations: &Observations,
        context: &Context,
    ) -> Self {
        let of_waves = catalogue()
            .filter(|effect| is_of_stray_waves(*effect) && context.tries(effect.id()))
            .map(|effect| effect.id());
        let context = Context { tried: Some(of_waves.collect()), ..context.clone() };
        let frontier = std::slice::from_ref(set);
        Self::asking(|_, _| true, frontier, known, noise_is_settled, observations, &context)
    }

    fn asking(
        asks_for_stray_waves: impl Fn(usize, &Base<'_>) -> bool + Sync,
        frontier: &[ScoredModel],
        known: Vec<Vec<EffectId>>,
        noise_is_settled: bool,
        observations: &Observations,
        context: &Context,
    ) -> Self {
        let sets = sets(frontier, known, observations, context);
        let far = frontier.iter().all(|scored| !is_near(&scored.fit, observations));
        let coarse = match far {
            true => FEW_READINGS,
            false => {
                COARSE_READINGS_NEAR.min((observations.len() * 2 / 5).max(FEWEST_READINGS_NEAR))
            }
        };
        let coarse = observations.thinned(coarse);
        let bases: Vec<Base<'_>> = frontier
            .par_iter()
            .enumerate()
            .map(|(number, scored)| {
                let base = Base::of(scored, noise_is_settled, observations, &coarse, context);
                Base { asks_for_stray_waves: asks_for_stray_waves(number, &base), ..base }
            })
            .collect();
        let (sets, unseen): (Vec<_>, Vec<_>) =
            sets.into_par_iter().partition_map(|set| match bases[set.number].unseen(&set) {
                Some(unseen) => Either::Right(unseen),
                None => Either::Left(set),
            });
        let rough: Vec<(Extended, Fit)> = sets
            .into_par_iter()
            .filter_map(|set| {
                let fit = bases[set.number].coarse_fit(set.effect, &coarse, context)?;
                Some((set, fit))
            })
            .collect();
        // The gain of a coarse fit grows in proportion to the number of readings.
        let share = observations.len() as f64 / coarse.len() as f64;
        let estimates: Vec<Estimate> = rough
            .iter()
            .map(|(set, fit)| {
                let base = &bases[set.number];
                // Each fitted number gains one by chance, which does not grow.
                let by_chance = fit.values.last().map_or(0, Vec::len) as f64;
                let of_readings = share * (base.coarse_cost - fit.cost - by_chance);
                let of_setup = base.scored.fit.of_setup - fit.of_setup;
                // Two angles of each element follow whatever is missing: what their freedom costs is known from the coarse fit.
                let values = fit.values.last().map_or(&[][..], Vec::as_slice);
                let of_freedom = fit.cost_of_elements - base.scored.fit.cost_of_elements
                    + set.effect.against_size(values);
                let log_evidence =
                    0.5 * (of_readings + of_setup) - of_freedom + base.scored.log_evidence;
                Estimate { log_evidence, by_cost: log_evidence - base.nats_of_unknown_noise }
            })
            .collect();
        let is_kept = are_kept(&estimates);
        let (kept, given_up): (Vec<_>, Vec<_>) =
            rough.into_iter().zip(is_kept).partition(|(_, is_kept)| *is_kept);
        let fitted: Vec<(ScoredModel, bool)> = kept
            .into_par_iter()
            .map(|((set, fit), _)| match share > 1.0 {
                true => bases[set.number].fit_to_all(set.effect, fit, observations, context),
                false => (ScoredModel::of(fit, observations), false),
            })
            .collect();
        // Rivals are compared by their covariances, which want the derivatives of their own minimum.
        let all = frontier.iter().chain(fitted.iter().map(|(scored, _)| scored));
        let best = all.map(|scored| scored.log_evidence).fold(f64::NEG_INFINITY, f64::max);
        let at_minimum = |(scored, adds_nothing): (ScoredModel, bool)| {
            if adds_nothing || scored.log_evidence <= best - RIVALS.get() {
                return scored;
            }
            ScoredModel::of(refined(scored.fit, observations, context, SEARCH, None), observations)
        };
        let fitted = fitted.into_par_iter().map(at_minimum).collect();
        let given_up = given_up.into_iter().map(|((set, _), _)| set.ids).collect();
        Self { fitted, given_up, unseen }
    }
}

/// Whether an effect is searched for among thousands of places.
fn is_of_stray_waves(effect: &dyn Effect) -> bool {
    matches!(effect.search(), Search::Walls | Search::Objects)
}

/// What a coarse fit expects of a set on all readings, nats.
#[derive(Clone, Copy)]
struct Estimate {
    log_evidence: f64,
    /// The same if the noise were known exactly.
    by_cost: f64,
}

/// Which sets are fitted further: those that are hopeful by either estimate. Far from the readings the evidence falls less than in proportion to the cost. By the
/// first, what a poor set saves would count for more than it lacks; by the second, rivals seem far from each other.
fn are_kept(estimates: &[Estimate]) -> Vec<bool> {
    let least = least_kept(estimates.iter().map(|estimate| estimate.log_evidence));
    let least_by_cost = least_kept(estimates.iter().map(|estimate| estimate.by_cost));
    let is_kept =
        |estimate: &Estimate| estimate.log_evidence >= least || estimate.by_cost >= least_by_cost;
    estimates.iter().map(is_kept).collect()
}

/// The least estimate that is hopeful. Far from the readings all sets but one are far behind, but another may become the best with the next effect.
fn least_kept(estimates: impl Iterator<Item = f64>) -> f64 {
    let mut best_first: Vec<f64> = estimates.collect();
    best_first.sort_by(|a, b| b.total_cmp(a));
    let [Some(best), Some(kept_anyway)] =
        [best_first.first(), best_first.get(KEPT_IN_ANY_CASE - 1).or(best_first.last())]
    else {
        return f64::NEG_INFINITY;
    };
    kept_anyway.min(best - GIVEN_UP)
}

/// The sets to fit, each once.
fn sets(
    frontier: &[ScoredModel],
    mut known: Vec<Vec<EffectId>>,
    observations: &Observations,
    context: &Context,
) -> Vec<Extended> {
    let mut sets = Vec::new();
    for (number, scored) in frontier.iter().enumerate() {
        let held = scored.fit.ids();
        // A fit of hundreds of elements takes long: where the drives are few, they are fitted beside the best set alone.
        let of_elements = observations.tell_each_element()
            || number == 0 && observations.elements() <= MOST_ELEMENTS_OF_ONE_SET;
        if !of_elements && scored.fit.has_random_elements() {
            continue;
        }
        for effect in catalogue() {
            let one_by_one = matches!(effect.search(), Search::Random | Search::Exchanges);
            // A simulator does not change between two records.
            let steady = effect.is_defect() && context.common.is_some();
            if steady
                || one_by_one && !of_elements
                || !context.tries(effect.id())
                || held.contains(&effect.id())
                || !effect.can_act(observations)
            {
                continue;
            }
            let mut ids = held.clone();
            ids.push(effect.id());
            ids.sort_unstable();
            if !known.contains(&ids) {
                known.push(ids.clone());
                sets.push(Extended { number, effect, ids });
            }
        }
    }
    sets
}

/// A set to be extended, with what all its extensions need.
struct Base<'o> {
    scored: &'o ScoredModel,
    scores: ScoreStatistics<'o>,
    quick: QuickScores<'o>,
    near: bool,
    /// Whether a fluctuation of the field may explain the residual.
    may_fluctuate: bool,
    /// Whether walls and objects are looked for.
    asks_for_stray_waves: bool,
    /// By how much its evidence is higher than if the noise were known exactly.
    nats_of_unknown_noise: f64,
    /// Its cost on the few readings.
    coarse_cost: f64,
    /// The derivatives of the few readings by what is fitted already.
    coarse_slopes: Slopes,
}

impl<'o> Base<'o> {
    fn of(
        scored: &'o ScoredModel,
        noise_is_settled: bool,
        observations: &'o Observations,
        coarse: &Observations,
        context: &'o Context,
    ) -> Self {
        let near = is_near(&scored.fit, observations);
        // Without repeats the noise is an estimate from the residual, of which a fluctuation would only take up the error.
        let noise_is_told = observations.is_noise_told();
        Self {
            scored,
            scores: ScoreStatistics::of(observations, context, &scored.fit),
            quick: QuickScores::of(&scored.fit, observations, context),
            near,
            may_fluctuate: observations.are_fluctuating()
                || near && noise_is_settled && noise_is_told,
            asks_for_stray_waves: true,
            nats_of_unknown_noise: nats_of_unknown_noise(&scored.fit, observations),
            coarse_cost: cost_on(coarse, &scored.fit, context),
            coarse_slopes: ScoreStatistics::of(coarse, context, &scored.fit).into_slopes(),
        }
    }

    /// The derivatives of all readings by what is fitted already; `None` where the effect would change them.
    fn known(&self, effect: &'static dyn Effect) -> Option<&Slopes> {
        (self.near && self.keeps_slopes(effect)).then(|| self.scores.slopes())
    }

    /// Whether the readings go on following the departures of single elements as they did: what silences or exchanges an element changes how they follow
    /// its departure, and a fit by the slopes of before ends at departures of any size.
    fn keeps_slopes(&self, effect: &'static dyn Effect) -> bool {
        let is_random = |instance: &Instance| instance.effect.search() == Search::Random;
        let is_of_elements = matches!(effect.search(), Search::Sets | Search::Exchanges);
        let stated = &self.scores.context.stated;
        let elements_depart =
            stated.holds_elements() || self.scored.fit.instances.iter().any(is_random);
        // An effect takes the place of the departure of its kind.
        !(stated.holds(effect.id()) || is_of_elements && elements_depart)
    }

    /// The set with one more effect, if these readings cannot show it. Far from them the score statistic is unreliable.
    fn unseen(&self, set: &Extended) -> Option<Unseen> {
        let gained =
            if self.near { expected_nats(&self.scores, set.effect) } else { f64::INFINITY };
        let fit = &self.scored.fit;
        (gained < LEAST_EXPECTED_NATS.get()).then(|| Unseen {
            of: sorted_ids(fit),
            nats: gained - cost_of_one_more(fit, set.effect),
        })
    }

    /// The best fit with one more effect, to few readings; `None` if none of its starts gains enough.
    fn coarse_fit(
        &self,
        effect: &'static dyn Effect,
        coarse: &Observations,
        context: &Context,
    ) -> Option<Fit> {
        // A fluctuation that the repeats do not show must not compensate for an unexplained gap or a misjudged noise.
        if effect.scatters_repeats() && !self.may_fluctuate {
            return None;
        }
        if is_of_stray_waves(effect) && !self.asks_for_stray_waves {
            return None;
        }
        let before = &self.scored.fit;
        // Linearisation at the neutral point is valid only for effects that start there and leave the scatter as it is.
        let neutral = effect.neutral();
        let begins_there = effect.starts(context).contains(&neutral);
        let slope_leads = self.near && begins_there && !effect.begins_flat(context);
        let start = |beginning: Beginning, from: &Fit| {
            let mut values = from.values.clone();
            values.push(beginning.values);
            let mut spreads = before.spreads.clone();
            spreads.push(f64::NAN);
            let instances = extended(before, effect, beginning.choice);
            let nuisance = Some(from.nuisance.clone());
            Start { instances, values, spreads, nuisance }
        };
        let plausible = |beginning: &Beginning| {
            let instance = Instance { effect, choice: beginning.choice.clone() };
            is_plausible(coarse, context, &instance, &beginning.values)
        };
        let known = self.keeps_slopes(effect).then_some(&self.coarse_slopes);
        let mut starts: Vec<(Start, Option<&Slopes>)> =
            beginnings(effect, &self.quick, &self.scores, slope_leads, context)
                .into_iter()
                .filter(plausible)
                .map(|beginning| (start(beginning, before), known))
                .collect();
        starts.extend(
            from_departure(before, effect)
                .filter(plausible)
                .map(|beginning| (start(beginning, before), None)),
        );
        // Phases fitted to each element may contain the effect of phase steps or of an exchange.
        let of_phases = matches!(effect.search(), Search::Steps | Search::Exchanges);
        if let Some(without) = without_phases(before).filter(|_| of_phases) {
            let scored = QuickScores::of(&without, self.scores.observations, context);
            let others = beginnings(effect, &scored, &self.scores, slope_leads, context);
            let others = others.into_iter().map(|other| start(other, &without));
            starts.extend(others.map(|start| (start, None)));
        }
        for (elements, without) in in_place_of_departures(before, effect, context) {
            let choice = Choice::Elements(elements);
            starts.push((start(Beginning { choice, values: Vec::new() }, &without), None));
        }
        let stopping = if starts.len() > 1 { FIRST_STEPS } else { ROUGH };
        // All readings told the spread of the elements that depart already.
        let fitted =
            |start: Start, stopping: Stopping, known: Option<&Slopes>| match effect.search() {
                Search::Random => fit_any(coarse, context, start, stopping, known),
                _ => fit_beside(coarse, context, start, stopping, known),
            };
        let best = starts
            .into_iter()
            .map(|(start, known)| fitted(start, stopping, known))
            .max_by(|a, b| log_evidence(a, coarse).total_cmp(&log_evidence(b, coarse)))?;
        if stopping == ROUGH {
            return Some(best);
        }
        Some(fitted(best.into(), ROUGH, None))
    }

    /// A coarse fit with one more effect, fitted to all readings, and whether the effect adds nothing: the fit then ended after one step, and the next would not bring it near.
    fn fit_to_all(
        &self,
        effect: &'static dyn Effect,
        fit: Fit,
        observations: &Observations,
        context: &Context,
    ) -> (ScoredModel, bool) {
        let known = self.known(effect);
        let after = |fit: Fit, stopping: Stopping| {
            ScoredModel::of(refined(fit, observations, context, stopping, known), observations)
        };
        if !self.near || effect.search() == Search::Random {
            return (after(fit, SEARCH), false);
        }
        let first = after(fit, ONE_STEP);
        let expected = first.log_evidence + 0.5 * first.fit.expected_fall;
        if expected < self.scored.log_evidence - ONE_STEP_SHORT_BY {
            return (first, true);
        }
        (after(first.fit, SEARCH), false)
    }
}

/// An effect takes the place of a departure of its kind, and may be no more than that: what the fit found of it is where the effect begins.
fn from_departure(fit: &Fit, effect: &dyn Effect) -> impl Iterator<Item = Beginning> {
    let known = fit.nuisance.departures.get(&effect.id()).cloned();
    known.into_iter().map(|values| Beginning { choice: Choice::None, values })
}

/// Nats of evidence expected of an effect to first order; infinite where the slope says nothing.
fn expected_nats(scores: &ScoreStatistics<'_>, effect: &'static dyn Effect) -> f64 {
    match effect.search() {
        Search::Smooth if effect.begins_flat(scores.context) => f64::INFINITY,
        // The way on which the robot arrived outside of rows is chosen anew for each size: the slope is that of one way only.
        Search::Smooth if effect.facts().timing.is_of_arrival() => f64::INFINITY,
        Search::Smooth => {
            let score = scores.of_effect(effect, &effect.neutral());
            let Some(gained) = score.gained() else { return f64::INFINITY };
            0.5 * gained - cost_of_freedom(score.downhill.len(), gained.sqrt())
        }
        Search::Random => {
            let neutral = effect.no_departures(scores.observations.elements());
            let ScoreStatistic { downhill, curvature, .. } = scores.of_effect(effect, &neutral);
            best_spread(curvature, &downhill).1
        }
        _ => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests;
