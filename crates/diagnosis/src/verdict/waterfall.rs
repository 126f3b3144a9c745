//! How the gap shrinks as the effects of the best set are added one after another.

use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::result::{WaterfallPart, WaterfallStep};
use crate::selection::scored_model::ScoredModel;
use crate::verdict::gap_size::{gap, noise_floor, scatter_beside};

/// A smaller share of the alignment is counted to the first effect: a report shows tenths of a percent.
const LEAST_ALIGNMENT: f64 = 1e-3;

/// Shares of the squared gap beyond noise, from the gap of the nominal simulation down to that of the best set.
///
/// The alignment comes first: the shift and the near field beside the best set. The defects of the simulator follow, then the effects
/// of physics, at each step the one that reduces the gap most. Each part of the set has its own best parameters, but the shift of the whole set: the free shift of a part
/// would take up an offset. The last step is the residual.
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
    let mut step = |part, effect, now: f64| {
        let now = now.min(rest);
        steps.push(WaterfallStep { part, effect, share: (rest - now) / whole });
        rest = now;
    };
    let aligned = parts.left_by(&[]);
    if whole - aligned > LEAST_ALIGNMENT * whole {
        step(WaterfallPart::Alignment, None, aligned);
    }
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
        let Self { observations, context, scored } = self;
        let whole = part.len() == scored[0].fit.instances.len();
        let mut fit = self.fitted(part);
        if !whole {
            // A departure of the set-up in whose place the set has an effect is that of the part.
            let mut beside = scored[0].fit.nuisance.clone();
            for (id, values) in std::mem::take(&mut fit.nuisance.departures) {
                beside.departures.entry(id).or_insert(values);
            }
            fit.nuisance = beside;
            let scans = fit.model(context).best_gain_beside(observations, &fit.nuisance);
            fit.nuisance = fit.nuisance.with_scans(scans);
        }
        let expected = fit.model(context).expected_readings(observations, &fit.nuisance);
        beyond(gap(observations, &expected), scatter_beside(observations, &fit, context))
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
