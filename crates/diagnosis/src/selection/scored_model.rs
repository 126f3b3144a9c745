//! A set of effects as it was fitted, with the evidence for it.

use std::collections::HashSet;

use crate::effect_id::EffectId;
use crate::fit::any::refined;
use crate::fit::joint_fit::{self, Fit, SEARCH, Start, fit};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::selection::evidence::log_evidence;

/// Fits after which the spread of elements within a stated uncertainty is settled to a percent.
const SPREADS_SETTLE: usize = 3;

/// Whether a fit leaves little more than noise and its own scatter.
pub(crate) fn is_near(fit: &Fit, observations: &Observations) -> bool {
    joint_fit::is_near(fit.chi_square, observations)
}

/// Whether a fit leaves little more than noise, so that it tells the noise: one with a larger scatter of its own does not.
pub(crate) fn leaves_noise(fit: &Fit, observations: &Observations) -> bool {
    joint_fit::is_near(fit.cost, observations)
}

/// A set of effects as it was fitted, with the logarithm of its evidence.
#[derive(Clone)]
pub(crate) struct ScoredModel {
    pub fit: Fit,
    pub log_evidence: f64,
    /// Evidence for one more effect, any of those that these readings cannot show, over the evidence for the set alone.
    pub unseen: f64,
}

impl ScoredModel {
    pub fn of(fit: Fit, observations: &Observations) -> Self {
        Self { log_evidence: log_evidence(&fit, observations), fit, unseen: 0.0 }
    }
}

/// The sets, the best first, of those with the same effects the best alone.
pub(crate) fn best_first(mut sets: Vec<ScoredModel>) -> Vec<ScoredModel> {
    sets.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    let mut seen = HashSet::new();
    sets.retain(|set| seen.insert(sorted_ids(&set.fit)));
    sets
}

/// The effects of a fit in the order of the catalogue, by which sets are compared.
pub(crate) fn sorted_ids(fit: &Fit) -> Vec<EffectId> {
    let mut ids = fit.ids();
    ids.sort_unstable();
    ids
}

/// The believed set-up with nothing added.
pub(crate) fn believed(observations: &Observations, context: &Context) -> ScoredModel {
    let start = Start { instances: vec![], values: vec![], spreads: vec![], nuisance: None };
    let mut fit = fit(observations, context, start, SEARCH);
    if context.stated.holds_elements() {
        // How large the departures are is found from one fit for the next.
        for _ in 0..SPREADS_SETTLE {
            fit = refined(fit, observations, context, SEARCH, None);
        }
    }
    ScoredModel::of(fit, observations)
}

impl ScoredModel {
    /// The same set, its effects ordered so that each explains the most after those before it, by the fitted parts of the set. The
    /// free shift of the parts counts as unexplained: it would take up an offset.
    pub fn by_what_each_explains(self, all: &[Self]) -> Self {
        let mut order: Vec<usize> = Vec::new();
        let ids = self.fit.ids();
        while order.len() < ids.len() {
            let cost_with = |next: usize| {
                let part: Vec<EffectId> = order.iter().chain([&next]).map(|&n| ids[n]).collect();
                let is_part = |scored: &&Self| {
                    let others = scored.fit.ids();
                    others.len() == part.len() && part.iter().all(|id| others.contains(id))
                };
                all.iter().find(is_part).map_or(f64::INFINITY, |part| part.fit.cost_with_setup())
            };
            let left = (0..ids.len()).filter(|n| !order.contains(n));
            let next = left.min_by(|&a, &b| cost_with(a).total_cmp(&cost_with(b)));
            order.extend(next);
        }
        Self { fit: self.fit.in_order(&order), ..self }
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation};

    use super::*;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, read};
    use crate::model::effect::Choice;
    use crate::model::forward_model::ForwardModel;
    use crate::model::instance::Instance;

    /// Beside a displaced origin and a gain that makes up for elements which are all a little louder.
    #[test]
    fn departures_of_elements_are_found_beside_those_of_the_set_up() {
        let array = Array::square(4, 4, 10e-3).expect("not empty");
        let bench = Bench::of(array, Excitation::Uniform).with_elements_known_to(0.08, 0.13);
        let mut context = bench.context.clone();
        context.stated.origin_m = Some(0.7e-3);
        let ids = [EffectId::ElementGain, EffectId::ElementPhase];
        let truth = [bench.waves(0.12, 2.4), bench.waves(0.3, 1.7)];
        let instance = |id| Instance { effect: effect(id), choice: Choice::None };
        let instances = [ids[0], ids[1], EffectId::Offset].map(instance);
        let values = [truth[0].clone(), truth[1].clone(), vec![0.6, -0.8, 0.7]];
        let mut observations = Bench::in_six_planes(10e-3);
        read(&mut observations, &ForwardModel::of(&instances, &values, &context));
        let ScoredModel { fit, log_evidence: evidence, .. } = believed(&observations, &context);
        assert!(fit.expected_fall < 0.1, "{}", fit.expected_fall);
        // They are larger than stated, and the spreads have followed.
        let again = refined(fit.clone(), &observations, &context, SEARCH, None);
        let penalised = [again.penalised, fit.penalised];
        assert!((penalised[0] - penalised[1]).abs() < 0.1, "{penalised:?}");
        assert!(fit.nuisance.spreads[&EffectId::ElementPhase] > 0.15);
        // Their freedom has its cost.
        let free = Fit { cost_of_departures: 0.0, ..fit.clone() };
        assert!(fit.cost_of_departures > 20.0, "{}", fit.cost_of_departures);
        assert!(log_evidence(&free, &observations) - evidence > 20.0);
        let found = fit.nuisance;
        for (id, truth) in ids.into_iter().zip(truth) {
            let errors = found.departures[&id].iter().zip(&truth).map(|(f, t)| (f - t).powi(2));
            let rms = (errors.sum::<f64>() / truth.len() as f64).sqrt();
            assert!(rms < 0.05, "{id}: {rms}");
        }
    }
}
