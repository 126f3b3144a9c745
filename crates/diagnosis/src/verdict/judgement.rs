//! The verdict: which set of effects, if any, is named.

use crate::effect_id::EffectId;
use crate::fit::joint_fit::Fit;
use crate::limits::{
    CERTAIN, FAINT, IMMATERIAL, LARGE, MATERIAL, MOST_RIVALS, RESIDUAL_SHARE, ROUNDING_SHARE,
    SUFFICES_ALONE,
};
use crate::model::instance::Instance;
use crate::model::observations::Observations;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::patterns::in_slow_patterns;
use crate::residual_structure::test::{Kind, Test};
use crate::result::Verdict;
use crate::selection::scored_model::ScoredModel;

/// The verdict and what it rests on.
pub(crate) struct Judgement {
    pub verdict: Verdict,
    /// Numbers of the named set, or of the rivals, best first.
    pub named: Vec<usize>,
    /// How many rivals there are, those included that are not named.
    pub rivals: usize,
    /// Probability of each scored set, and of those with one more effect that the readings cannot show.
    pub probabilities: Vec<f64>,
    /// Whether several effects fit, but are not named because the gap is faint.
    pub too_faint: bool,
    /// Of what the named set is a part, if it does not explain the gap alone.
    pub part_of: Option<PartOf>,
}

/// Rival sets of many effects, of which only the common part is beyond doubt.
pub(crate) struct PartOf {
    /// Numbers of the sets that hold the part, the best first. The parameters of the part are those of the best.
    pub rivals: Vec<usize>,
    /// Sets of others, each of which explains what the part leaves.
    pub left_to: Vec<Vec<EffectId>>,
}

/// Judges the scored sets, the best first, by what the best leaves.
pub(crate) fn judge(
    observations: &Observations,
    scored: &[ScoredModel],
    believed: &ScoredModel,
    of_best: &ResidualStructure,
) -> Judgement {
    let probabilities = probabilities(scored);
    let n = observations.len() as f64;
    let gap = (believed.fit.cost - n).max(0.0);
    let judgement = |verdict, named: Vec<usize>| Judgement {
        verdict,
        rivals: named.len(),
        named,
        probabilities: probabilities.clone(),
        too_faint: false,
        part_of: None,
    };
    if is_structured(observations, scored, believed, of_best) {
        return judgement(Verdict::Unexplained, Vec::new());
    }
    if scored[0].fit.instances.is_empty() {
        return judgement(Verdict::None, Vec::new());
    }
    let named = |verdict, named: Vec<usize>| {
        let several = named.iter().all(|&number| has_several_causes(&scored[number]));
        if several && is_faint(&believed.fit, &scored[0].fit, n) {
            return Judgement { too_faint: true, ..judgement(Verdict::Unexplained, Vec::new()) };
        }
        judgement(verdict, named)
    };
    // A small share of a large gap may be left with structure: no formula is exact.
    let explained = match of_best.tests.iter().any(Test::fails) {
        true => Verdict::MostlyExplained,
        false => Verdict::Explained,
    };
    if let Some(number) = certain_set(scored, &probabilities) {
        return named(explained, vec![number]);
    }
    let rivals = rivals(scored, &probabilities);
    if rivals.iter().any(|&rival| scored[rival].fit.instances.is_empty()) {
        return judgement(Verdict::None, Vec::new());
    }
    if let Some(common) = common_part(scored, &rivals, gap) {
        return named(explained, vec![common]);
    }
    match rivals.len() {
        1 => named(explained, rivals),
        // Of many the likeliest are named: few readings tell few effects apart, and a further scan does.
        all => Judgement {
            rivals: all,
            ..named(Verdict::Ambiguous, rivals[..all.min(MOST_RIVALS)].to_vec())
        },
    }
}

/// Whether the best set leaves more than noise and the formulas' own error.
fn is_structured(
    observations: &Observations,
    scored: &[ScoredModel],
    believed: &ScoredModel,
    of_best: &ResidualStructure,
) -> bool {
    let n = observations.len() as f64;
    let excess = |cost: f64| (cost - n).max(0.0);
    let best = &scored[0].fit;
    // A noise judged by the residual hides the excess chi-square, and not its structure.
    let residual = excess(best.cost).max(in_slow_patterns(observations, &of_best.residuals));
    let share = residual / excess(believed.fit.cost);
    let many = best.physical_effects() > 2 || best.instances.len() > 1 && residual > 0.5 * n;
    let imitates = many && share > MATERIAL.get();
    // Of a gap within the noise no share is small.
    let residual_share = if believed.fit.cost > LARGE * n && !imitates { share } else { 1.0 };
    of_best.tests.iter().filter(|test| test.fails()).any(|test: &Test| match test.kind {
        Kind::NoFlaw => true,
        Kind::Pattern => residual_share > RESIDUAL_SHARE.get(),
        Kind::Converter => test.z * test.z * n > ROUNDING_SHARE * excess(believed.fit.cost),
    })
}

/// Whether the best set explains little. Departures of the set-up within its stated uncertainty may hide a large gap at a great cost of their own, which the
/// causes save.
fn is_faint(believed: &Fit, best: &Fit, n: f64) -> bool {
    let of_departures = |fit: &Fit| match believed.cost_of_departures > 0.0 {
        true => fit.of_setup + 2.0 * fit.cost_of_departures,
        false => 0.0,
    };
    let explained = believed.cost - best.cost.min(n);
    explained + of_departures(believed) - of_departures(best) < FAINT.get() * n
}

/// Whether a set has more than one cause. An offset does not count: it shows in a shift larger than setting-up leaves, however faint
/// the rest.
fn has_several_causes(set: &ScoredModel) -> bool {
    let of_shift = |instance: &Instance| instance.effect.is_told_by_shift();
    let by_shift = usize::from(set.fit.instances.iter().any(of_shift));
    set.fit.physical_effects() - by_shift > 1
}

/// The largest set that is certain and suffices alone; larger sets that hold it only add what is doubtful.
fn certain_set(scored: &[ScoredModel], probabilities: &[f64]) -> Option<usize> {
    // To name a set is to say that its effects are there, not that there are no others: sets that hold it and more support it.
    let support = |number: usize| support(&scored[number].fit.ids(), scored, probabilities);
    (0..scored.len())
        .filter(|number| !scored[*number].fit.instances.is_empty())
        .filter(|number| probabilities[*number] >= SUFFICES_ALONE.get())
        .filter(|number| support(*number) >= CERTAIN.get())
        .max_by_key(|number| scored[*number].fit.instances.len())
}

/// Probability of all sets that hold these effects.
pub(crate) fn support(ids: &[EffectId], scored: &[ScoredModel], probabilities: &[f64]) -> f64 {
    let holds = |set: &ScoredModel| {
        let others = set.fit.ids();
        ids.iter().all(|id| others.contains(id))
    };
    scored.iter().zip(probabilities).filter(|(set, _)| holds(set)).map(|(_, p)| p).sum()
}

/// The best sets that together are likely enough, but for those that hold a better one.
fn rivals(scored: &[ScoredModel], probabilities: &[f64]) -> Vec<usize> {
    let mut rivals: Vec<usize> = Vec::new();
    let mut together = 0.0;
    for (number, set) in scored.iter().enumerate() {
        let ids = set.fit.ids();
        let holds_a_rival =
            rivals.iter().any(|&rival| scored[rival].fit.ids().iter().all(|id| ids.contains(id)));
        if !holds_a_rival {
            rivals.push(number);
        }
        together += probabilities[number];
        if together >= CERTAIN.get() {
            break;
        }
    }
    rivals
}

/// The common part of rivals of three effects, if the third effect of each explains an immaterial share of the gap: it only compensates
/// for an error of a formula.
fn common_part(scored: &[ScoredModel], rivals: &[usize], gap: f64) -> Option<usize> {
    let all_hold = |part: &ScoredModel| {
        let ids = part.fit.ids();
        rivals.iter().all(|&rival| {
            let others = scored[rival].fit.ids();
            others.len() == ids.len() + 1 && ids.iter().all(|id| others.contains(id))
        })
    };
    let of_three = rivals.iter().all(|&rival| scored[rival].fit.physical_effects() == 3);
    let nearly_explains =
        |part: &ScoredModel| part.fit.cost - scored[rivals[0]].fit.cost < IMMATERIAL * gap;
    (of_three && rivals.len() > 1)
        .then(|| scored.iter().position(|part| all_hold(part) && nearly_explains(part)))
        .flatten()
}

/// Evidence over the sum of all evidence.
fn probabilities(scored: &[ScoredModel]) -> Vec<f64> {
    let best = scored[0].log_evidence;
    let weight = |set: &ScoredModel| (1.0 + set.unseen) * (set.log_evidence - best).exp();
    let weights: Vec<f64> = scored.iter().map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::effect;
    use crate::model::effect::Choice;

    fn scored(ids: &[EffectId], cost: f64) -> ScoredModel {
        let instance = |id: EffectId| Instance { effect: effect(id), choice: Choice::None };
        let instances = ids.iter().copied().map(instance).collect();
        let fit = Fit { instances, cost, ..Fit::of_nothing(Vec::new()) };
        ScoredModel { fit, log_evidence: -0.5 * cost, unseen: 0.0 }
    }

    /// No effect as likely as four times that of one, and a quarter as likely with any that cannot be seen.
    #[test]
    fn what_cannot_be_seen_keeps_its_part_of_the_probability() {
        let nothing = ScoredModel { unseen: 0.25, ..scored(&[], 0.0) };
        let lag = scored(&[EffectId::Lag], 2.0 * 4f64.ln());
        let probabilities = probabilities(&[nothing, lag]);
        assert!((probabilities[0] - 1.25 / 1.5).abs() < 1e-12, "{probabilities:?}");
        assert!((probabilities[1] - 0.25 / 1.5).abs() < 1e-12, "{probabilities:?}");
    }

    /// A thousand readings that leave nothing but noise either way: with causes, or with departures that cost as much as a gap of half a standard deviation.
    #[test]
    fn a_gap_that_departures_hide_at_great_cost_is_not_faint() {
        let fit = |cost: f64, of_setup: f64, cost_of_departures: f64| Fit {
            cost,
            of_setup,
            cost_of_departures,
            ..Fit::of_nothing(Vec::new())
        };
        let causes = fit(1000.0, 5.0, 20.0);
        assert!(!is_faint(&fit(1050.0, 200.0, 20.0), &causes, 1000.0));
        assert!(!is_faint(&fit(1050.0, 5.0, 110.0), &causes, 1000.0));
        assert!(is_faint(&fit(1050.0, 5.0, 20.0), &causes, 1000.0));
        assert!(!is_faint(&fit(1200.0, 5.0, 20.0), &causes, 1000.0));
        // The free shift of a careful set-up counts as it did before anything was stated.
        assert!(is_faint(&fit(1050.0, 200.0, 0.0), &fit(1000.0, 0.0, 0.0), 1000.0));
    }

    #[test]
    fn rivals_of_three_effects_are_known_by_what_they_share() {
        let gap = 10_000.0;
        let sets = |cost_of_two: f64| {
            [
                scored(&[EffectId::Spreading, EffectId::Lag, EffectId::GainDrift], 5000.0),
                scored(&[EffectId::Spreading, EffectId::Lag, EffectId::Clipping], 5001.0),
                scored(&[EffectId::Lag, EffectId::Clipping], 9000.0),
                scored(&[EffectId::Spreading, EffectId::Lag], cost_of_two),
            ]
        };
        assert_eq!(common_part(&sets(5015.0), &[0, 1], gap), Some(3));
        // Here the third effect explains more than an error of a formula.
        assert_eq!(common_part(&sets(5100.0), &[0, 1], gap), None);
        assert_eq!(common_part(&sets(5015.0), &[0], gap), None);
        let of_two = [
            scored(&[EffectId::Spreading, EffectId::Aperture], 5000.0),
            scored(&[EffectId::Spreading, EffectId::Directivity], 5001.0),
            scored(&[EffectId::Spreading], 5010.0),
        ];
        assert_eq!(common_part(&of_two, &[0, 1], gap), None);
    }
}
