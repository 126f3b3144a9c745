//! Tests of what a set is extended by, and how far each extension is fitted.

use fieldgap_acoustics::Vec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::effects::testing::{Bench, nuisance};
use crate::limits::NO_EFFECT;
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisances;
use crate::model::stated_uncertainty::StatedDeparture;
use crate::selection::scored_model::believed;

/// Noisy readings of an array with these causes.
fn observations(bench: &Bench, causes: &ForwardModel<'_>) -> Observations {
    let at = |n: i32| Vec3::new(f64::from(n % 20), f64::from(n / 20 % 20), 0.0) * 2e-3;
    let below = |n: i32| Vec3::new(-0.02, -0.02, if n < 400 { 0.09 } else { 0.13 });
    let places = (0..800).map(|n| at(n) + below(n)).collect();
    let mut observations = bench.observations(&[(bench.believed().excitation.clone(), places)]);
    let expected = causes.expected_readings(&observations, &[nuisance()]);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let scan = &mut observations.scans[0];
    for (n, level) in expected.into_iter().enumerate() {
        let lot: f64 = StandardNormal.sample(&mut random);
        let reading = (level + scan.scale.deviation(level) * lot).abs();
        scan.drives[0].readings[n] = reading;
        scan.drives[0].stabilised[n] = scan.scale.of(reading);
    }
    observations
}

/// Its numbers take the place of others in the fit, whose slopes would be taken for those of the next.
#[test]
fn an_effect_in_place_of_a_departure_of_the_set_up_keeps_no_slopes() {
    let bench = Bench::new();
    let mut context = bench.context.clone();
    let instance = Instance { effect: effect(EffectId::SoundSpeed), choice: Choice::None };
    context.stated.departures = vec![StatedDeparture { instance, priors: vec![(1.0, 1e-3)] }];
    let observations = observations(&bench, &ForwardModel::believed());
    let coarse = observations.thinned(160);
    let base = believed(&observations, &context);
    let base = Base::of(&base, true, &observations, &coarse, &context);
    assert!(base.keeps_slopes(effect(EffectId::Pitch)));
    assert!(!base.keeps_slopes(effect(EffectId::SoundSpeed)));
}

#[test]
fn an_effect_may_begin_where_the_departure_was_whose_place_it_takes() {
    let mut nuisance = Nuisances::from(vec![nuisance()]);
    nuisance.departures.insert(EffectId::SoundSpeed, vec![1.003]);
    let fit = Fit::of_nothing(nuisance);
    let starts = |id| -> Vec<Vec<f64>> {
        from_departure(&fit, effect(id)).map(|beginning| beginning.values).collect()
    };
    assert_eq!(starts(EffectId::SoundSpeed), [[1.003]]);
    assert!(starts(EffectId::Pitch).is_empty());
}

/// The pitch fitted to a fifth of the readings, then to all: where it is off, until nothing is left to gain; where it is not, for one step.
#[test]
fn a_fit_goes_on_where_its_effect_adds_something() {
    let bench = Bench::new();
    let context = &bench.context;
    for (ratio, acts) in [(1.004, true), (1.0, false)] {
        let observations = observations(&bench, &bench.model(EffectId::Pitch, &[ratio]));
        let coarse = observations.thinned(160);
        let base = believed(&observations, context);
        let base = Base::of(&base, true, &observations, &coarse, context);
        assert!(base.near, "{ratio}");
        let effect = effect(EffectId::Pitch);
        let instances = extended(&base.scored.fit, effect, Choice::None);
        let nuisance = Some(base.scored.fit.nuisance.clone());
        let values = vec![effect.neutral()];
        let start = Start { instances, values, spreads: vec![f64::NAN], nuisance };
        let fit = fit_any(&coarse, context, start, ROUGH, None);
        let (found, adds_nothing) = base.fit_to_all(effect, fit, &observations, context);
        assert_eq!(adds_nothing, !acts, "{ratio}");
        let gained = found.log_evidence - base.scored.log_evidence;
        assert!(if acts { gained > 5.0 } else { gained < 0.0 }, "{ratio}: {gained}");
        let again = refined(found.fit.clone(), &observations, context, SEARCH, None);
        let left = ScoredModel::of(again, &observations).log_evidence - found.log_evidence;
        assert!(!acts || left < 0.1, "{ratio}: {left}");
    }
}

/// Of an effect of one number that gains nothing the prior leaves one part in six, e^-1.85, beside that of an effect.
#[test]
fn an_effect_that_cannot_be_seen_keeps_what_its_prior_leaves_it() {
    let bench = Bench::new();
    let observations = observations(&bench, &bench.model(EffectId::Pitch, &[1.0]));
    let base = [believed(&observations, &bench.context)];
    let tried = Some([EffectId::Pitch].into());
    let context = Context { tried, ..bench.context.clone() };
    let Extension { fitted, unseen, .. } =
        Extension::of(&base, vec![], true, &observations, &context);
    let [Unseen { of, nats }] = unseen.as_slice() else { panic!("{unseen:?}") };
    assert!(fitted.is_empty() && of.is_empty());
    let prior = -NO_EFFECT.get();
    assert!((prior - 1.86..prior + LEAST_EXPECTED_NATS.get()).contains(nats), "{nats}");
}

/// A fit of unequal elements takes it for one that departs by all of its amplitude, and the others for as unequal.
#[test]
fn a_silent_element_leaves_the_others_nearly_equal() {
    const SILENT: usize = 5;
    const SPREAD: f64 = 0.02;
    let bench = Bench::new();
    let unequal = Instance { effect: effect(EffectId::ElementGain), choice: Choice::None };
    let silent =
        Instance { effect: effect(EffectId::DeadElements), choice: Choice::Elements(vec![SILENT]) };
    let elements = bench.believed().array.len();
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let lots: Vec<f64> = StandardNormal.sample_iter(&mut random).take(elements).collect();
    let departures = lots.into_iter().map(|lot| SPREAD * lot).collect();
    let causes = [unequal.clone(), silent.clone()];
    let causes = ForwardModel::of(&causes, &[departures, vec![]], &bench.context);
    let observations = observations(&bench, &causes);
    let mut near = vec![0.0; elements];
    near[SILENT] = -0.9;
    let start = Start {
        instances: vec![unequal],
        values: vec![near],
        spreads: vec![f64::NAN],
        nuisance: None,
    };
    let imitated = fit_any(&observations, &bench.context, start, SEARCH, None);
    assert!((imitated.values[0][SILENT] + 1.0).abs() < 0.1, "{:?}", imitated.values);
    assert!(imitated.spreads[0] > 5.0 * SPREAD, "{:?}", imitated.spreads);
    let imitated = [ScoredModel::of(imitated, &observations)];
    // The slopes by the departures hold beside another pitch, and not beside a silent element.
    let coarse = observations.thinned(160);
    let base = Base::of(&imitated[0], true, &observations, &coarse, &bench.context);
    assert!(base.known(effect(EffectId::Pitch)).is_some());
    assert!(base.known(effect(EffectId::DeadElements)).is_none());
    let tried = Some([EffectId::DeadElements].into());
    let context = Context { tried, ..bench.context.clone() };
    let Extension { fitted, .. } = Extension::of(&imitated, vec![], true, &observations, &context);
    let [found] = fitted.as_slice() else { panic!("{} sets", fitted.len()) };
    assert_eq!(found.fit.instances[1].choice, silent.choice);
    assert!((found.fit.spreads[0] / SPREAD - 1.0).abs() < 0.5, "{:?}", found.fit.spreads);
    assert!(found.log_evidence > imitated[0].log_evidence + 10.0);
}

/// Far from the readings the evidence falls less than in proportion to what is left, since the noise may be larger. What another effect saves a poor set must
/// then not count for more than that set lacks.
#[test]
fn a_far_set_is_not_hopeful_for_what_another_effect_saves_it() {
    let bench = Bench::new();
    let alone = |id| Instance { effect: effect(id), choice: Choice::None };
    let causes = [alone(EffectId::ElementGain), alone(EffectId::StandingWave)];
    let values = [bench.waves(0.5, 2.3), vec![0.3, 0.2]];
    let causes = ForwardModel::of(&causes, &values, &bench.context);
    let observations = observations(&bench, &causes);
    let fitted = |id| {
        let elements = bench.believed().array.len();
        let start = Start {
            instances: vec![alone(id)],
            values: vec![vec![0.0; elements]],
            spreads: vec![f64::NAN],
            nuisance: None,
        };
        let fit = fit_any(&observations, &bench.context, start, SEARCH, None);
        ScoredModel::of(fit, &observations)
    };
    let frontier = [fitted(EffectId::ElementGain), fitted(EffectId::ElementPhase)];
    let Extension { fitted, .. } =
        Extension::of(&frontier, vec![], true, &observations, &bench.context);
    let true_set = [EffectId::ElementGain, EffectId::StandingWave];
    assert!(fitted.iter().any(|set| set.fit.ids() == true_set && is_near(&set.fit, &observations)));
}

/// Of twelve sets the first five are kept by either estimate, and those within 80 nats of the best.
#[test]
fn sets_are_kept_that_are_hopeful_by_either_estimate() {
    let kept = |log_evidence: f64, by_cost: f64| {
        let estimate = |n: f64| Estimate { log_evidence: log_evidence * n, by_cost: by_cost * n };
        let kept = are_kept(&(0..12).map(|n| estimate(f64::from(n))).collect::<Vec<_>>());
        (0..12).filter(|&n| kept[n]).collect::<Vec<_>>()
    };
    assert_eq!(kept(-10.0, -100.0), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(kept(-100.0, -10.0), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(kept(-100.0, 50.0), [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]);
    assert!(are_kept(&[]).is_empty());
}
