//! How the gap shrinks as the effects of the best set are added one after another.

use crate::effect_id::EffectId;
use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::result::{WaterfallPart, WaterfallStep};
use crate::selection::scored_model::ScoredModel;
use crate::verdict::gap_size::{gap, noise_floor, scatter_beside};

/// A smaller share of what every candidate leaves free is counted to what follows: a report shows tenths of a percent.
const LEAST_SHARE: f64 = 1e-3;

/// Shares of the squared gap beyond noise, from the gap of the nominal simulation down to that of the best set.
///
/// The alignment comes first: the shift and the near field beside the best set. The other departures of the set-up within its stated uncertainty follow, then the
/// defects of the simulator, then the effects of physics, at each step the one that reduces the gap most. Each part of the set has its own best parameters, but
/// the shift and the departures of the whole set: the free shift of a part would take up an offset, and its departures the effect in whose place they are. The
/// last step is the residual.
pub(crate) fn waterfall(
    observations: &Observations,
    context: &Context,
    scored: &[ScoredModel],
    gap_before: f64,
) -> Vec<WaterfallStep> {
    let parts = Parts { observations, context, scored };
    let whole = beyond(gap_before, noise_floor(observations));
    if whole <= 0.0 {
        return vec![WaterfallStep { part: WaterfallPart::Residual, effect: None, share: 1.0 }];
    }
    let mut rest = whole;
    let mut steps = Vec::new();
    let mut step = |part, effect: Option<EffectId>, now: f64| {
        let least = if effect.is_some() { 0.0 } else { LEAST_SHARE };
        let share = (rest - now).max(0.0) / whole;
        if share >= least {
            steps.push(WaterfallStep { part, effect, share });
            rest = now.min(rest);
        }
    };
    step(WaterfallPart::Alignment, None, parts.left_by_alignment());
    step(WaterfallPart::StatedUncertainty, None, parts.left_by(&[]));
    let ids = scored[0].fit.ids();
    let mut added: Vec<usize> = Vec::new();
    while added.len() < ids.len() {
        let left_with = |next: usize| {
            let with: Vec<usize> = added.iter().copied().chain([next]).collect();
            (next, parts.left_by(&with))
        };
        let is_defect = |number: &usize| scored[0].fit.instances[*number].effect.is_defect();
        let left: Vec<usize> = (0..ids.len()).filter(|number| !added.contains(number)).collect();
        let defects_left = left.iter().any(is_defect);
        let in_turn = left.into_iter().filter(|number| is_defect(number) == defects_left);
        let best = in_turn.map(left_with).min_by(|one, other| one.1.total_cmp(&other.1));
        let (next, now) = best.expect("an effect is left");
        step(WaterfallPart::Effect, Some(ids[next]), now);
        added.push(next);
    }
    steps.push(WaterfallStep { part: WaterfallPart::Residual, effect: None, share: rest / whole });
    steps
}

fn beyond(gap: f64, scatter: f64) -> f64 {
    (gap * gap - scatter * scatter).max(0.0)
}

/// Parts of the best set.
struct Parts<'s> {
    observations: &'s Observations,
    context: &'s Context,
    scored: &'s [ScoredModel],
}

impl Parts<'_> {
    /// The squared gap beyond noise with some effects of the best set, by their numbers.
    fn left_by(&self, part: &[usize]) -> f64 {
        let scored = self.scored;
        let whole = part.len() == scored[0].fit.instances.len();
        let mut fit = self.fitted(part);
        if !whole {
            // A departure of the set-up in whose place the set has an effect is a part of the effect: until that is added, the set-up is as stated.
            let nuisance =
                scored[0].fit.nuisance.clone().beside(&fit.instances, &self.context.stated);
            fit = self.with_best_gain(Fit { nuisance, ..fit });
        }
        self.left(&fit)
    }

    /// The same by the shift and the near field beside the best set alone, with the set-up otherwise as it is stated.
    fn left_by_alignment(&self) -> f64 {
        let mut nuisance = self.scored[0].fit.nuisance.clone();
        nuisance.departures.clear();
        let nuisance = nuisance.beside(&[], &self.context.stated);
        self.left(&self.with_best_gain(Fit::of_nothing(nuisance)))
    }

    /// A fit with the gain of each scan that is best beside all else.
    fn with_best_gain(&self, mut fit: Fit) -> Fit {
        let scans = fit.model(self.context).best_gain_beside(self.observations, &fit.nuisance);
        fit.nuisance = fit.nuisance.with_scans(scans);
        fit
    }

    fn left(&self, fit: &Fit) -> f64 {
        let Self { observations, context, .. } = self;
        let expected = fit.model(context).expected_readings(observations, &fit.nuisance);
        beyond(gap(observations, &expected), scatter_beside(observations, fit, context))
    }

    /// The fit of some effects of the best set: that of the search, which has most, or a new one.
    fn fitted(&self, part: &[usize]) -> Fit {
        let best = &self.scored[0].fit;
        let of = |number: &usize| best.instances[*number].effect.id();
        let is_part = |scored: &&ScoredModel| {
            let others = scored.fit.ids();
            others.len() == part.len() && part.iter().all(|number| others.contains(&of(number)))
        };
        if let Some(known) = self.scored.iter().find(is_part) {
            return known.fit.clone();
        }
        let start = Start {
            instances: part.iter().map(|&number| best.instances[number].clone()).collect(),
            values: part.iter().map(|&number| best.values[number].clone()).collect(),
            spreads: part.iter().map(|&number| best.spreads[number]).collect(),
            nuisance: Some(best.nuisance.clone()),
        };
        fit(self.observations, self.context, start, SEARCH)
    }
}
