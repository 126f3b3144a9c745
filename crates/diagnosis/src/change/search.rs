//! The search for what changed: every effect of the catalogue but the simulator's own defects, the departure of one element alone, and
//! pairs of the best.

use rayon::prelude::*;

use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::effects::one_element::{ONE_ELEMENT, OneElement};
use crate::fit::any::fit_any;
use crate::fit::joint_fit::{Fit, SEARCH, Start};
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{
    ELEMENT_KNOWN, ELEMENTS_TRIED, MATERIAL_OF_CHANGE, MOST_CHANGES, RIVALS, SINGLES_EXTENDED,
    UNCHANGED, WORTH_EXTENDING,
};
use crate::model::effect::{Choice, Context, Effect};
use crate::model::observations::Observations;
use crate::selection::extension::Extension;
use crate::selection::scored_model::{ScoredModel, believed, is_near};
use crate::selection::starts::extended;

/// Every set that was fitted, the best first; among them that of no effect, in which the level alone may have changed.
pub(crate) fn searched(observations: &Observations, context: &Context) -> Vec<ScoredModel> {
    let mut nothing = believed(observations, context);
    nothing.log_evidence += UNCHANGED;
    let gap = (nothing.fit.cost - observations.len() as f64).max(0.0);
    let mut scored = vec![nothing.clone()];
    let mut frontier = vec![nothing];
    for _ in 0..MOST_CHANGES {
        let best = scored[0].clone();
        let known = scored.iter().map(|set| sorted_ids(&set.fit)).collect();
        // A fluctuation of the field is asked for only where the repeats show it.
        let mut grown = Extension::of(&frontier, known, false, observations, context).fitted;
        let of_one: Vec<ScoredModel> = frontier
            .par_iter()
            .flat_map(|set| with_one_element(set, observations, context))
            .collect();
        grown.extend(of_one.into_iter().filter(|set| !is_dead_element(&set.fit)));
        grown.retain(|set| {
            set.fit.instances.len() < 2 || best.fit.cost - set.fit.cost > MATERIAL_OF_CHANGE * gap
        });
        scored.extend(grown.iter().cloned());
        each_once(&mut scored);
        each_once(&mut grown);
        let goes_on = grown
            .first()
            .is_some_and(|grown| grown.log_evidence > best.log_evidence + WORTH_EXTENDING);
        if !goes_on {
            break;
        }
        // Far from the readings any set may become the best with the next effect.
        let near = is_near(&grown[0].fit, observations);
        let least = grown[0].log_evidence - RIVALS.get();
        grown.retain(|set| !near || set.log_evidence >= least);
        grown.truncate(SINGLES_EXTENDED);
        frontier = grown;
    }
    scored
}

/// Whether a fit has an element that lost all of its amplitude but for what is within the error of the model of A: it is called dead.
fn is_dead_element(fit: &Fit) -> bool {
    fit.instances.iter().zip(&fit.values).any(|(instance, values)| {
        instance.effect.id() == EffectId::ElementGain
            && matches!(values[..], [departure] if departure < ELEMENT_KNOWN - 1.0)
    })
}

/// Sorted by evidence; of sets with the same effects the best is kept.
fn each_once(sets: &mut Vec<ScoredModel>) {
    sets.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    let mut seen: Vec<Vec<EffectId>> = Vec::new();
    sets.retain(|set| {
        let ids = sorted_ids(&set.fit);
        let is_new = !seen.contains(&ids);
        seen.push(ids);
        is_new
    });
}

fn sorted_ids(fit: &Fit) -> Vec<EffectId> {
    let mut ids = fit.ids();
    ids.sort_unstable();
    ids
}

/// The set with a departure of one element, for each kind of departure that it does not hold yet.
fn with_one_element(
    set: &ScoredModel,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    if observations.elements() < 2 {
        return Vec::new();
    }
    let held = set.fit.ids();
    let scores = ScoreStatistics::of(observations, context, &set.fit);
    if set.fit.model(context).depends_on_arrival() {
        return Vec::new();
    }
    let best_of = |of_one: &'static OneElement| -> Option<ScoredModel> {
        if held.contains(&of_one.id()) {
            return None;
        }
        let of_all = scores.columns_of(effect(of_one.id()), &vec![0.0; observations.elements()]);
        let mut tried: Vec<(f64, f64, usize)> = of_all
            .into_iter()
            .enumerate()
            .map(|(element, column)| {
                let score = scores.of_columns(&[column]);
                let curvature = score.curvature[(0, 0)].max(f64::MIN_POSITIVE);
                let step = score.downhill[0] / curvature;
                (score.downhill[0] * step, step, element)
            })
            .collect();
        tried.sort_by(|one, other| other.0.total_cmp(&one.0));
        let parameter = of_one.parameters()[0];
        tried
            .into_iter()
            .take(ELEMENTS_TRIED)
            .map(|(_, step, element)| {
                let before = set.fit.clone();
                let choice = Choice::Elements(vec![element]);
                let mut values = before.values.clone();
                values.push(vec![step.clamp(parameter.least, parameter.most)]);
                let mut spreads = before.spreads.clone();
                spreads.push(f64::NAN);
                let start = Start {
                    instances: extended(&before, of_one, choice),
                    values,
                    spreads,
                    nuisance: Some(before.nuisance),
                };
                ScoredModel::of(fit_any(observations, context, start, SEARCH, None), observations)
            })
            .max_by(|one, other| one.log_evidence.total_cmp(&other.log_evidence))
    };
    ONE_ELEMENT.iter().filter_map(best_of).collect()
}
