//! Tests of fits of sets of effects: where they lead, and what their numbers cost.

use super::*;
use fieldgap_acoustics::{Array, Excitation};

use crate::effects::effect;
use crate::effects::testing::{Bench, Flown, nuisance, read};
use crate::model::effect::Choice;
use crate::model::phases::PhaseMeaning;
use crate::statistics::phase_noise::PhaseNoise;

#[test]
fn in_another_order_every_effect_keeps_its_numbers_and_errors() {
    let instance = |id| Instance { effect: effect(id), choice: Choice::None };
    let nuisance = Nuisance::from_slice(&[0.0; Nuisance::COUNT]);
    let size = Nuisance::COUNT + 4;
    let fit = Fit {
        instances: vec![instance(EffectId::Offset), instance(EffectId::Pitch)],
        values: vec![vec![1.0, 2.0, 3.0], vec![4.0]],
        spreads: vec![f64::NAN, 0.5],
        covariance: Some(DMatrix::from_fn(size, size, |i, j| (10 * i + j) as f64)),
        ..Fit::of_nothing(vec![nuisance])
    };
    let (before, fit) = (fit.clone(), fit.in_order(&[1, 0]));
    assert_eq!(fit.ids(), [EffectId::Pitch, EffectId::Offset]);
    assert_eq!(fit.values, [vec![4.0], vec![1.0, 2.0, 3.0]]);
    assert_eq!(fit.spreads[0], 0.5);
    let [now, old] = [&fit, &before].map(|fit| fit.covariance.as_ref().expect("one"));
    let [pitch, offset] = [fit.ranges()[0].start, fit.ranges()[1].start];
    let [old_offset, old_pitch] = [before.ranges()[0].start, before.ranges()[1].start];
    assert_eq!(now[(pitch, offset + 2)], old[(old_pitch, old_offset + 2)]);
    assert_eq!(now[(offset + 1, 0)], old[(old_offset + 1, 0)]);
}

/// Of one number it is half of the square of its standard errors; of several alike, what they gain together counts.
#[test]
fn the_nats_of_an_effect_are_those_of_its_size_in_standard_errors() {
    let instance = |id| Instance { effect: effect(id), choice: Choice::None };
    let nuisance = Nuisance::from_slice(&[0.0; Nuisance::COUNT]);
    let mut covariance = DMatrix::identity(Nuisance::COUNT + 4, Nuisance::COUNT + 4);
    let first = Nuisance::COUNT;
    (covariance[(first, first + 1)], covariance[(first + 1, first)]) = (0.6, 0.6);
    covariance[(first + 3, first + 3)] = 1e-6;
    let fit = Fit {
        instances: vec![instance(EffectId::Offset), instance(EffectId::Pitch)],
        values: vec![vec![2.0, -2.0, 0.0], vec![1.003]],
        spreads: vec![f64::NAN; 2],
        covariance: Some(covariance),
        ..Fit::of_nothing(vec![nuisance])
    };
    // x, -x with the correlation r have the square 2x²/(1 - r).
    let [offset, pitch] = [0, 1].map(|number| fit.nats_of(number).expect("determined"));
    assert!((offset - 10.0).abs() < 1e-9 && (pitch - 4.5).abs() < 1e-9, "{offset} {pitch}");
    assert_eq!(Fit { covariance: None, ..fit }.nats_of(0), None);
}

/// Whether their departures are called an effect or are within what is stated: known equally well, they cost the same.
#[test]
fn the_freedom_of_elements_costs_the_same_by_whatever_name() {
    let array = Array::square(4, 4, 10e-3).expect("not empty");
    let stated = Bench::of(array, Excitation::Uniform).with_elements_known_to(0.08, 0.13);
    let observations = Bench::in_six_planes(10e-3);
    let instances = [EffectId::ElementPhase, EffectId::Pitch]
        .map(|id| Instance { effect: effect(id), choice: Choice::None });
    let cost_with = |instances: &[Instance]| {
        let values = |instance: &Instance| match instance.effect.id() {
            EffectId::Pitch => vec![1.0],
            _ => vec![0.0; 16],
        };
        let values = instances.iter().map(values).collect();
        let spreads = instances.iter().rev().map(|_| 0.13).skip(1).chain([f64::NAN]).collect();
        let start = Start { instances: instances.to_vec(), values, spreads, nuisance: None };
        fit(&observations, &stated.context, start, SEARCH)
    };
    let [by_effect, within] = [&instances[..], &instances[1..]].map(cost_with);
    let elements = by_effect.cost_of_departures + by_effect.cost_of_elements;
    assert!(by_effect.cost_of_elements > 5.0, "{}", by_effect.cost_of_elements);
    assert_eq!(within.cost_of_elements, 0.0);
    assert!((elements - within.cost_of_departures).abs() < 1e-3 * elements, "{elements}");
}

/// Of a speed of sound 6 % below the one believed. Downhill from there ends elsewhere, since phases are off by more than half a turn.
#[test]
fn amplitudes_lead_where_phases_are_off_by_more_than_half_a_turn() {
    const RATIO: f64 = 0.94;
    let bench = Bench::new();
    let mut observations = Bench::in_six_planes(10e-3);
    let count = observations.len() as f64;
    let visits = &mut observations.scans[0].drives[0].visits;
    visits.iter_mut().for_each(|visit| visit.progress = visit.number as f64 / count);
    let model = bench.model(EffectId::SoundSpeed, &[RATIO]);
    read(&mut observations, &model);
    let scan = &mut observations.scans[0];
    let noise = PhaseNoise { rad: 0.02, within: 1.0 };
    scan.phase = Some(PhaseMeaning { noise, drift_u_rad: 0.1, moves_rad: 0.1, each_drive: false });
    let drive = &mut scan.drives[0];
    let phases = |model: &ForwardModel<'_>| {
        let pressures = model.pressures_at(drive.driven(), &drive.visits, &nuisance());
        pressures.iter().map(|pressure| pressure.coherent.arg()).collect()
    };
    [drive.phases_rad, drive.believed_rad] = [phases(&model), phases(&ForwardModel::believed())];
    let sound_speed = Instance { effect: effect(EffectId::SoundSpeed), choice: Choice::None };
    let start = Start {
        instances: vec![sound_speed],
        values: vec![vec![1.0]],
        spreads: vec![f64::NAN],
        nuisance: None,
    };
    let downhill = descended(&observations, &bench.context, start.clone(), SEARCH, None);
    assert!((downhill.values[0][0] - RATIO).abs() > 1e-3, "{:?}", downhill.values);
    let found = fit(&observations, &bench.context, start, SEARCH);
    assert!((found.values[0][0] - RATIO).abs() < 2e-4, "{:?}", found.values);
    assert!(is_near(found.chi_square, &observations), "{}", found.chi_square);
}

/// Repeats allow less of a scattered position than these readings have. Beside it, at that limit, play is found as without a limit.
#[test]
fn an_effect_at_its_limit_leaves_the_others_free() {
    const PLAY_MM: f64 = 0.7;
    const MOST_JITTER_MM: f64 = 0.1;
    let Flown { bench, mut observations } = Flown::with(EffectId::Backlash, PLAY_MM, 0.4);
    observations.scans[0].scatter.most_jitter_mm = MOST_JITTER_MM;
    let instances = [EffectId::PositionJitter, EffectId::Backlash]
        .map(|id| Instance { effect: effect(id), choice: Choice::None });
    let start = Start {
        instances: instances.to_vec(),
        values: vec![vec![MOST_JITTER_MM.powi(2); 3], vec![0.1]],
        spreads: vec![f64::NAN; 2],
        nuisance: None,
    };
    let found = fit(&observations, &bench.context, start, SEARCH);
    let [variances_mm2, play_mm] = &found.values[..] else { panic!("{:?}", found.values) };
    assert!(
        variances_mm2[..2].iter().all(|v| *v <= 2.0 * MOST_JITTER_MM.powi(2)),
        "{variances_mm2:?}"
    );
    assert!((play_mm[0] - PLAY_MM).abs() < 0.2, "{play_mm:?}");
}
