//! Sets of many effects, found by the joint fit, then fitted and scored as those of the stepwise search are.

use rayon::prelude::*;

use crate::effect_id::EffectId;
use crate::effects::catalogue;
use crate::fit::any::{first_steps, refined};
use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::joint::exchanges::Exchanges;
use crate::joint::widths::{asked_for, joins, relevant, restarted};
use crate::limits::{
    ANOTHER_EFFECT, JOINT_ROUNDS, NOISE_ROUNDS, READINGS_OF_A_SEARCH, RIVALS, SHORT_AT_FIRST,
    STRUCTURE_AFTER_EXCHANGES, STRUCTURE_BEFORE_EXCHANGES, UNQUESTIONED, WORTH_EXTENDING,
};
use crate::model::effect::{Context, Effect, Expected, Search};
use crate::model::observations::Observations;
use crate::noise::settle::{NoiseChange, settled_again};
use crate::selection::extension::Extension;
use crate::selection::scored_model::{ScoredModel, best_first, is_near, leaves_noise, sorted_ids};
use crate::statistics::noise_scale::NoiseScale;

/// The best set of many effects, and its rivals.
pub(crate) struct ManyCauses {
    /// The set; its effects stand in the order of the gaps that they make.
    pub set: ScoredModel,
    /// Sets with others in place of some of its effects.
    pub others: Vec<ScoredModel>,
    /// The readings, with the noise that the set leaves.
    pub observations: Observations,
    /// Whether that noise is another than before.
    pub noise_changed: bool,
}

/// The best set of many effects, where it is near the readings.
///
/// The joint fit begins at the best set of few, and at the set-up as believed: the effects that a stepwise search chose first may not be
/// there. Some readings tell the large effects. On all of them the small ones follow one after another, and the noise is judged again, since
/// a set of few counts what it leaves as noise. A set that leaves much structure, `structure_of` as the largest result of a test over its limit, is given up.
pub(crate) fn of_many_causes(
    few: &ScoredModel,
    believed: &ScoredModel,
    observations: &Observations,
    context: &Context,
    structure_of: impl Fn(&ScoredModel, &Observations) -> f64,
) -> Option<ManyCauses> {
    let some = observations.thinned(READINGS_OF_A_SEARCH);
    let starts = [&few.fit, &believed.fit];
    let found_from = |from: &Fit| ScoredModel::of(named(from, &some, context), &some);
    let mut best = best_of(starts.into_par_iter().map(found_from).collect())?;
    for _ in 0..JOINT_ROUNDS {
        if is_near(&best.fit, &some) {
            best = without_what_adds_nothing(best, &some, context);
        }
        let Some(next) = with_what_has_no_slope(&best, |_| true, &some, context) else { break };
        // Beside it, others may be asked for that took up its part, or none.
        let again = found_from(&next.fit);
        best = if again.log_evidence > next.log_evidence { again } else { next };
    }
    if !is_near(&best.fit, &some) {
        return None;
    }
    let mut observations = observations.clone();
    let mut noise_changed = false;
    let mut sets = vec![on_all(best.fit, &observations, context)];
    if structure_of(&sets[0], &observations) > STRUCTURE_BEFORE_EXCHANGES {
        return None;
    }
    for _ in 0..NOISE_ROUNDS {
        sets = explored(sets, &observations, context);
        if structure_of(&sets[0], &observations) > STRUCTURE_AFTER_EXCHANGES {
            return None;
        }
        let best = &sets[0].fit;
        if !leaves_noise(best, &observations) {
            break;
        }
        let noise = settled_again(&mut observations, &best.model(context), &best.nuisance, context);
        if noise == NoiseChange::Alike {
            break;
        }
        noise_changed = true;
        let least = sets[0].log_evidence - RIVALS.get();
        sets.retain(|set| set.log_evidence >= least);
        let fits = sets.into_par_iter().map(|set| on_all(set.fit, &observations, context));
        sets = best_first(fits.collect());
    }
    let best = without_what_adds_nothing(sets.remove(0), &observations, context);
    let set = ScoredModel { fit: by_size(best.fit, &observations, context), ..best };
    let near = is_near(&set.fit, &observations);
    near.then_some(ManyCauses { set, others: sets, observations, noise_changed })
}

/// Sets and others that were found from there, the best first: by exchanges, one set after another, and by what no exchange finds.
fn explored(
    mut known: Vec<ScoredModel>,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let mut left: Vec<Vec<EffectId>> = Vec::new();
    for _ in 0..JOINT_ROUNDS {
        let best = known[0].log_evidence;
        let is_open = |set: &&ScoredModel| {
            set.log_evidence >= best - RIVALS.get() && !left.contains(&sorted_ids(&set.fit))
        };
        let Some(next) = known.iter().find(is_open).cloned() else { break };
        left.push(sorted_ids(&next.fit));
        let Some(exchanges) = Exchanges::of(&next.fit, observations, context) else { break };
        known.extend(fitted(exchanges.best(), best, observations, context));
        if next.log_evidence == best && known.iter().all(|set| set.log_evidence <= best) {
            // Walls and objects, whose search takes long, show on some readings.
            let sought = |search| !matches!(search, Search::Walls | Search::Objects);
            known.extend(with_what_has_no_slope(&next, sought, observations, context));
        }
        known = best_first(known);
    }
    known
}

/// Sets fitted from there; to the end if they come near the evidence of the best set.
fn fitted(
    starts: Vec<Start>,
    best: f64,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let fitted = starts.into_par_iter().filter_map(|start| {
        let first = ScoredModel::of(first_steps(start, observations, context), observations);
        match first.log_evidence > best - SHORT_AT_FIRST {
            true => Some(on_all(first.fit, observations, context)),
            false => first.log_evidence.is_finite().then_some(first),
        }
    });
    fitted.collect()
}

fn best_of(sets: Vec<ScoredModel>) -> Option<ScoredModel> {
    sets.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
}

/// A set that was fitted to some readings, fitted to all.
fn on_all(fit: Fit, observations: &Observations, context: &Context) -> ScoredModel {
    ScoredModel::of(refined(fit, observations, context, SEARCH, None), observations)
}

/// The effects that a joint fit from there keeps, with priors as wide as a set of few has them.
fn named(from: &Fit, observations: &Observations, context: &Context) -> Fit {
    let joint = relevant(from, observations, context);
    let Some((kept, _)) = asked_for(&joint, ANOTHER_EFFECT.get()) else { return joint };
    let mut start = restarted(&joint, &kept);
    for (instance, spread) in start.instances.iter().zip(&mut start.spreads) {
        if instance.effect.search() != Search::Random {
            *spread = f64::NAN;
        }
    }
    fit(observations, context, start, SEARCH)
}

/// The set with one more effect of those that are in no joint fit and are sought, if the evidence asks for it.
fn with_what_has_no_slope(
    set: &ScoredModel,
    is_sought: impl Fn(Search) -> bool,
    observations: &Observations,
    context: &Context,
) -> Option<ScoredModel> {
    let is_other = |effect: &&'static dyn Effect| {
        is_sought(effect.search()) && !joins(*effect, observations, context)
    };
    let others = catalogue().filter(is_other).map(|effect| effect.id());
    let others = others.filter(|id| context.tries(*id)).collect();
    let context = &Context { tried: Some(others), ..context.clone() };
    let Extension { fitted, .. } =
        Extension::of(std::slice::from_ref(set), Vec::new(), true, observations, context);
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
pub(crate) fn one_less(
    set: &ScoredModel,
    observations: &Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let physical = (0..set.fit.instances.len()).into_par_iter().filter(|&number| {
        !set.fit.instances[number].effect.is_defect()
            && set.fit.nats_of(number).is_none_or(|nats| nats < UNQUESTIONED)
    });
    let less = physical.map(|number| on_all(set.fit.without(number), observations, context));
    less.collect()
}

/// The fit with its effects in the order of the gaps that each makes, the largest first: what it changes of the expected readings, and of
/// their scatter.
fn by_size(fit: Fit, observations: &Observations, context: &Context) -> Fit {
    let whole = on_scale(&fit, observations, context);
    let gaps: Vec<f64> = (0..fit.instances.len())
        .into_par_iter()
        .map(|number| {
            let mut less = fit.without(number);
            let model = less.model(context);
            // Beside its own gain: a change of the level is no gap.
            let scans = model.best_gain_beside(observations, &less.nuisance);
            less.nuisance = less.nuisance.with_scans(scans);
            let less = on_scale(&less, observations, context);
            let changes = whole.iter().zip(&less);
            changes
                .map(|(one, other)| {
                    (one.reading - other.reading).powi(2)
                        + (one.variance_ratio - other.variance_ratio).abs()
                })
                .sum()
        })
        .collect();
    let mut order: Vec<usize> = (0..gaps.len()).collect();
    order.sort_by(|a, b| gaps[*b].total_cmp(&gaps[*a]));
    fit.in_order(&order)
}

/// The readings that a fit expects, in standard deviations of the noise.
fn on_scale(fit: &Fit, observations: &Observations, context: &Context) -> Vec<Expected> {
    let expected = fit.model(context).expected_with_scatter(observations, &fit.nuisance);
    let scales = observations.scans.iter().flat_map(|scan| {
        std::iter::repeat_n(&scan.scale, scan.drives.iter().map(|d| d.readings.len()).sum())
    });
    let on_scale = |(expected, scale): (Expected, &NoiseScale)| Expected {
        reading: scale.of(expected.reading),
        ..expected
    };
    expected.into_iter().zip(scales).map(on_scale).collect()
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Vec3;

    use super::*;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, nuisance};
    use crate::effects::turbulence;
    use crate::model::effect::Choice;
    use crate::model::forward_model::ForwardModel;
    use crate::model::instance::Instance;

    /// Turbulence that doubles the scatter hardly changes the expected readings. A pitch that is off by 0.2 % changes them by less than the noise.
    #[test]
    fn an_effect_that_only_scatters_readings_counts_by_their_scatter() {
        let bench = Bench::new();
        let places = (0..200).map(|n| Vec3::new(1e-4 * f64::from(n), 0.0, 0.1)).collect();
        let observations = bench.observations(&[(bench.believed().excitation.clone(), places)]);
        let order = |rad_per_sqrt_m: f64| {
            let pitch = Instance { effect: effect(EffectId::Pitch), choice: Choice::None };
            let air =
                Instance { effect: effect(EffectId::Turbulence), choice: turbulence::OF_PATHS };
            let fit = Fit {
                instances: vec![pitch, air],
                values: vec![vec![1.002], vec![rad_per_sqrt_m]],
                spreads: vec![f64::NAN; 2],
                ..Fit::of_nothing(vec![nuisance()])
            };
            by_size(fit, &observations, &bench.context).ids()
        };
        assert_eq!(order(0.6), [EffectId::Turbulence, EffectId::Pitch]);
        assert_eq!(order(1e-4), [EffectId::Pitch, EffectId::Turbulence]);
    }

    /// A wider pitch beside a ball, begun at two effects that imitate the pitch.
    #[test]
    fn effects_beside_an_object_are_exchanged() {
        const RATIO: f64 = 1.01;
        let bench = Bench::new();
        let context = &bench.context;
        let instance = |id| Instance { effect: effect(id), choice: Choice::None };
        let ball = vec![25.0, 10.0, 40.0, 5.0];
        let truth = Bench::in_six_planes(10e-3 * RATIO);
        let model = ForwardModel::of(
            &[instance(EffectId::Scatterer)],
            std::slice::from_ref(&ball),
            context,
        );
        let readings = model.expected_readings(&truth, &[nuisance()]);
        let mut observations = Bench::in_six_planes(10e-3);
        let scan = &mut observations.scans[0];
        scan.drives[0].stabilised =
            readings.iter().map(|reading| scan.scale.of(*reading)).collect();
        scan.drives[0].readings = readings;
        let ids = [EffectId::Scatterer, EffectId::SoundSpeed, EffectId::AxisScale];
        let start = Start {
            instances: ids.map(instance).to_vec(),
            values: vec![
                ball,
                effect(EffectId::SoundSpeed).neutral(),
                effect(EffectId::AxisScale).neutral(),
            ],
            spreads: vec![f64::NAN; 3],
            nuisance: None,
        };
        let imitated = fit(&observations, context, start, SEARCH);
        let imitated = ScoredModel::of(imitated, &observations);
        let best = explored(vec![imitated.clone()], &observations, context).remove(0);
        assert_eq!(sorted_ids(&best.fit), [EffectId::Pitch, EffectId::Scatterer]);
        assert!(best.log_evidence > imitated.log_evidence);
        let pitch =
            best.fit.ids().iter().position(|id| *id == EffectId::Pitch).expect("it is held");
        assert!((best.fit.values[pitch][0] - RATIO).abs() < 1e-3, "{:?}", best.fit.values);
    }
}
