//! Tests of the derivatives of a problem against quotients of its residuals.

use fieldgap_acoustics::{Array, Excitation, Vec3};

use super::*;
use crate::effect_id::EffectId;
use crate::effects::effect;
use crate::effects::testing::{Bench, nuisance};
use crate::fit::joint_fit::unknowns;
use crate::model::effect::Choice;
use crate::model::nuisance::Nuisances;
use crate::model::phases::PhaseMeaning;
use crate::model::stated_uncertainty::StatedDeparture;
use crate::statistics::phase_noise::PhaseNoise;
use crate::statistics::scatter::Scatter;
use crate::statistics::slow_level::SlowNoise;

/// The derivative of all residuals by one number, from points on either side.
fn quotient(
    problem: &Problem<'_>,
    numbers: &[f64],
    unknowns: &[Unknown],
    number: usize,
) -> Vec<f64> {
    let step = 1e-2 * unknowns[number].scale;
    let [above, below] = [step, -step].map(|step| {
        let mut numbers = numbers.to_vec();
        numbers[number] += step;
        problem.evaluate(&numbers).squared.clone()
    });
    above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step)).collect()
}

/// Norm of what a column misses of a derivative, and of the derivative.
fn norms(whole: &[f64], column: &[f64]) -> [f64; 2] {
    let norm = |of: &mut dyn Iterator<Item = f64>| of.map(|x| x * x).sum::<f64>().sqrt();
    [norm(&mut whole.iter().zip(column).map(|(a, b)| a - b)), norm(&mut whole.iter().copied())]
}

/// Places about the axis, one above the other.
fn places(count: u32) -> Vec<Vec3> {
    let at = |n: f64| Vec3::new(0.02 * (2.4 * n).cos(), 0.02 * (1.7 * n).sin(), 0.08 + 5e-4 * n);
    (0..count).map(|n| at(f64::from(n))).collect()
}

/// The mean alone moves, but residuals by the field with its scatter are nearly the same.
#[test]
fn derivatives_beside_a_scattering_position_are_nearly_those_of_the_whole_field() {
    let bench = Bench::new();
    let drives = [(bench.believed().excitation.clone(), places(90))];
    let observations = bench.observations(&drives);
    let instances = [EffectId::SoundSpeed, EffectId::PositionJitter]
        .map(|id| Instance { effect: effect(id), choice: Choice::None });
    let values = [vec![1.01], vec![0.004, 0.002, 0.004]];
    let nuisance = vec![Nuisance::from_slice(&[0.0; Nuisance::COUNT])].into();
    let spreads = [f64::NAN; 2];
    let unknowns = unknowns(&instances, &values, &spreads, &nuisance, &bench.context);
    let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let problem = Problem::new(&observations, &bench.context, &instances, &values);
    let evaluation = problem.evaluate(&numbers);
    let readings = observations.len();
    for number in 1..=Nuisance::COUNT {
        let column = problem.columns(&numbers, &unknowns, number..number + 1, &evaluation);
        let whole = quotient(&problem, &numbers, &unknowns, number);
        let [missed, whole] = norms(&whole[..readings], &column[0][..readings]);
        let share = missed / whole;
        assert!(share < 0.2, "{number}: {share}");
    }
}

/// Phases of a field with another speed of sound and displaced places, beside a clock with an offset and a drift: what is left is small, and
/// derivatives with offset and drift taken out are those of the whole problem, which finds both anew.
#[test]
fn derivatives_of_phases_are_those_of_the_problem_with_its_reference_fitted_anew() {
    let bench = Bench::new();
    for each_drive in [false, true] {
        let drives = [
            (bench.believed().excitation.clone(), places(120)),
            (Excitation::Uniform, places(120)),
        ];
        let mut observations = bench.observations(&drives);
        let scan = &mut observations.scans[0];
        let model = bench.model(EffectId::SoundSpeed, &[1.002]);
        let last = 239.0;
        for drive in &mut scan.drives {
            let pressures = model.pressures_at(drive.driven(), &drive.visits, &nuisance());
            for (visit, pressure) in drive.visits.iter_mut().zip(pressures) {
                visit.progress = visit.number as f64 / last;
                let offset_rad = 2.0 + if each_drive { drive.number as f64 } else { 0.0 };
                let clock_rad = offset_rad + 0.1 * visit.progress;
                drive.phases_rad.push(pressure.coherent.arg() + clock_rad);
                drive.believed_rad.push(pressure.coherent.arg());
            }
        }
        drop(model);
        let noise = PhaseNoise { rad: 0.02, within: 1.0 };
        scan.phase = Some(PhaseMeaning { noise, drift_u_rad: 0.2, moves_rad: 0.2, each_drive });
        let instances = [EffectId::SoundSpeed, EffectId::ElementPhase]
            .map(|id| Instance { effect: effect(id), choice: Choice::None });
        let values = [vec![1.0021], vec![0.0; observations.elements()]];
        let nuisance = vec![Nuisance::from_slice(&[0.01, 1e-5, -1e-5, 1e-5, 0.05])].into();
        let unknowns = unknowns(&instances, &values, &[f64::NAN, 0.1], &nuisance, &bench.context);
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = Problem::new(&observations, &bench.context, &instances, &values);
        let evaluation = problem.evaluate(&numbers);
        assert_eq!(evaluation.squared.len(), 2 * observations.len());
        let few = Nuisance::COUNT + 3;
        let columns = problem.columns(&numbers, &unknowns, 0..few, &evaluation);
        for (number, column) in columns.iter().enumerate() {
            let whole = quotient(&problem, &numbers, &unknowns, number);
            let phases = observations.len()..;
            let [missed, whole] = norms(&whole[phases.clone()], &column[phases]);
            // By the gain no phase changes.
            let bound = if number == 0 { 1e-6 } else { 0.02 * whole };
            assert!(missed <= bound, "{number}: {missed} of {whole}");
            assert!(number == 0 || whole > 0.0, "{number}");
        }
    }
}

/// Of elements that lean already, and beside readings that lag, where they are taken through the pressures of the whole chain.
#[test]
fn derivatives_by_leaning_elements_are_those_of_the_problem() {
    let array = Array::square(4, 4, 10e-3).expect("not empty");
    let bench = Bench::of(array, Excitation::Uniform);
    let observations = bench.observations(&[(Excitation::Uniform, places(90))]);
    let lean: Vec<f64> = (0..32).map(|n| 0.2 * (1.3 * f64::from(n)).sin()).collect();
    for beside in [vec![], vec![(EffectId::Lag, vec![0.01])]] {
        let others = beside.into_iter();
        let (ids, values): (Vec<EffectId>, Vec<Vec<f64>>) =
            others.chain([(EffectId::ElementTilt, lean.clone())]).unzip();
        let instances: Vec<Instance> = ids
            .into_iter()
            .map(|id| Instance { effect: effect(id), choice: Choice::None })
            .collect();
        let spreads = vec![0.1; instances.len()];
        let nuisance = vec![Nuisance::from_slice(&[0.0; Nuisance::COUNT])].into();
        let unknowns = unknowns(&instances, &values, &spreads, &nuisance, &bench.context);
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = Problem::new(&observations, &bench.context, &instances, &values);
        let evaluation = problem.evaluate(&numbers);
        let range = numbers.len() - lean.len()..numbers.len();
        let columns = problem.columns(&numbers, &unknowns, range.clone(), &evaluation);
        for (number, column) in range.zip(&columns) {
            let whole = quotient(&problem, &numbers, &unknowns, number);
            let [missed, of_all] = norms(&whole, column);
            assert!(of_all > 0.0 && missed < 0.02 * of_all, "{number}: {missed} of {of_all}");
        }
    }
}

/// Also those of elements that were computed anew where others were kept from another point, and beside slow noise of the level.
#[test]
fn derivatives_by_departures_of_the_set_up_are_those_of_the_problem() {
    for slow in [None, SlowNoise::of(0.02, 600)] {
        derivatives_by_departures(slow);
    }
}

fn derivatives_by_departures(slow: Option<SlowNoise>) {
    let array = Array::square(4, 4, 10e-3).expect("not empty");
    let mut context = Bench::of(array, Excitation::Uniform).context;
    let departures = [
        (EffectId::SoundSpeed, vec![(1.0, 1e-3)]),
        (EffectId::ElementGain, vec![(0.0, 0.08); 16]),
        (EffectId::ElementPhase, vec![(0.0, 0.13); 16]),
        (EffectId::Reflection, vec![(400.0, 5.0), (0.0, 0.014), (0.0, 0.014)]),
        (EffectId::GainDrift, vec![(0.0, 0.005)]),
    ];
    context.stated.departures = departures
        .into_iter()
        .map(|(id, priors)| StatedDeparture {
            instance: Instance { effect: effect(id), choice: Choice::None },
            priors,
        })
        .collect();
    let mut observations = Bench::in_six_planes(10e-3);
    let visits = &mut observations.scans[0].drives[0].visits;
    visits.iter_mut().for_each(|visit| visit.progress = visit.number as f64 / 600.0);
    let scan = &mut observations.scans[0];
    scan.drives.iter_mut().for_each(|drive| drive.expected.clone_from(&drive.readings));
    scan.set_scatter(Scatter { slow, ..scan.scatter.clone() });
    let nuisance = Nuisances::from(vec![Nuisance::from_slice(&[0.0; Nuisance::COUNT])]);
    let nuisance = nuisance.beside(&[], &context.stated);
    let unknowns = unknowns(&[], &[], &[], &nuisance, &context);
    let problem = Problem::new(&observations, &context, &[], &[]);
    let begun: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let mut numbers = begun.clone();
    for (n, number) in problem.layout.departures().enumerate() {
        numbers[number] +=
            0.3 * (1.7 * n as f64).sin() * unknowns[number].prior.expect("one").1 / 0.1;
    }
    let mut kept = None;
    problem.linearise(&begun, &unknowns, &mut kept);
    let beside_kept = problem.linearise(&numbers, &unknowns, &mut kept).columns;
    let anew = problem.linearise(&numbers, &unknowns, &mut None).columns;
    let of_elements: Vec<usize> =
        problem.layout.spread_departures().flat_map(|(_, range)| range).collect();
    assert_eq!(of_elements.len(), 32);
    for number in (0..1).chain(problem.layout.departures()) {
        let whole = quotient(&problem, &numbers, &unknowns, number);
        let [missed, of_all] = norms(&whole, &anew[number]);
        assert!(missed < 0.02 * of_all, "{number}: {missed} of {of_all}");
        let [missed, _] = norms(&whole, &beside_kept[number]);
        let is_anew = missed < 0.02 * of_all;
        assert!(
            is_anew || number > 0 && !of_elements.contains(&number),
            "{number}: {missed} of {of_all}"
        );
    }
}
