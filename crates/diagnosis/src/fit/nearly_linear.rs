//! The beginning of a fit to amplitudes in which single elements depart.
//!
//! The amplitude |p| of a field that changes by δ is |p| + δ∥ + δ⊥²/2|p| to second order, with the parts of δ along and across the phase of p. Between lobes,
//! where p is small, unknown departures of the elements change the field by more than itself, and the last term is not small: a fit that trusts these readings
//! ends in a local minimum nearby, with the wrong sign of the field. While the departures are uncertain, the root mean square of that term, √3 v/2|p|
//! with the variance v of the normal δ⊥, is therefore counted as noise of the reading. It falls as the departures become known. (As in a filter of second order:
//! A. H. Jazwinski, *Stochastic Processes and Filtering Theory*, 1970, section 9.5.)

use fieldgap_acoustics::least_squares::{Factor, Parameter as Unknown, linear_minimum};
use nalgebra::DMatrix;

use crate::fit::problem::{Evaluation, Problem};

/// Steps, after which readings that are not nearly linear are few, or stay so.
const STEPS: usize = 6;

/// How often a step is halved that leads to what is not plausible.
const HALVINGS: usize = 6;

/// Where a fit begins: from these numbers, but with elements that do not depart, so many steps ahead.
pub(super) fn begun(problem: &Problem<'_>, unknowns: &[Unknown], from: &[f64]) -> Vec<f64> {
    let elements: Vec<usize> = problem.layout.random_ranges().into_iter().flatten().collect();
    let mut at = from.to_vec();
    elements.iter().for_each(|&n| at[n] = 0.0);
    let mut covariance = None;
    let mut kept = None;
    for _ in 0..STEPS {
        let evaluation = problem.evaluate(&at);
        let mut linear = problem.linearise(&at, unknowns, &mut kept);
        let curved = curved(problem, unknowns, &at, &evaluation, &elements, covariance.as_ref());
        let Some(curved) = curved else { break };
        let weights: Vec<f64> = curved.iter().map(|curved| 1.0 / curved.hypot(1.0)).collect();
        for column in linear.columns.iter_mut().chain([&mut linear.residuals]) {
            column.iter_mut().zip(&weights).for_each(|(value, weight)| *value *= weight);
        }
        let Some((least, known)) = linear_minimum(unknowns, at.clone(), linear) else { break };
        let share = |halved: usize| 0.5f64.powi(halved as i32);
        let trial = |halved: usize| -> Vec<f64> {
            at.iter().zip(&least).map(|(at, least)| at + share(halved) * (least - at)).collect()
        };
        let is_plausible = |trial: &Vec<f64>| problem.at(trial).iter().all(|r| r.is_finite());
        let Some(next) = (0..HALVINGS).map(trial).find(is_plausible) else { break };
        at = next;
        covariance = Some(known);
    }
    at
}

/// The root mean square of the quadratic term of each reading, in its standard deviations, while the departures have this covariance, or as before any reading.
fn curved(
    problem: &Problem<'_>,
    unknowns: &[Unknown],
    at: &[f64],
    evaluation: &Evaluation,
    elements: &[usize],
    covariance: Option<&DMatrix<f64>>,
) -> Option<Vec<f64>> {
    let sd = |n: usize| unknowns[n].prior.map_or(0.0, |(_, sd)| sd);
    let columns = problem.pressures_by_elements(at, unknowns, evaluation);
    let magnitudes = problem.magnitudes(at, evaluation);
    let across = DMatrix::from_fn(magnitudes.len(), elements.len(), |i, j| columns[j][i].im);
    // Variances are the squares of the rows of the departures' deviations, independent of one another, times what they change.
    let spread = match covariance {
        None => DMatrix::from_fn(elements.len(), elements.len(), |i, j| {
            if i == j { sd(elements[i]) } else { 0.0 }
        }),
        Some(covariance) => {
            let own = DMatrix::from_fn(elements.len(), elements.len(), |i, j| {
                covariance[(elements[i], elements[j])]
            });
            Factor::of(own)?.lower().clone()
        }
    };
    let changed = across * spread;
    let term = |(variance, (magnitude, slope)): (f64, &(f64, f64))| {
        slope * 0.75f64.sqrt() * variance / magnitude.max(f64::MIN_POSITIVE)
    };
    Some(changed.row_iter().map(|row| row.norm_squared()).zip(&magnitudes).map(term).collect())
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation, Vec3};

    use crate::effect_id::EffectId;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, read};
    use crate::fit::joint_fit::{SEARCH, Start, fit};
    use crate::model::effect::Choice;
    use crate::model::forward_model::ForwardModel;
    use crate::model::instance::Instance;

    /// Elements that depart by half a radian change the signs of the field between its lobes. Without noise the residuals of the true phases are zero.
    #[test]
    fn the_signs_between_lobes_are_found() {
        let array = Array::square(7, 7, 10e-3).expect("not empty");
        let bench = Bench::of(array, Excitation::Uniform).with_elements_known_to(0.08, 0.35);
        let places = (0..900).map(|n| {
            let (x, y, z) = (n % 15, n / 15 % 15, n / 225);
            Vec3::new(f64::from(x) - 7.0, f64::from(y) - 7.0, f64::from(z))
                .component_mul(&Vec3::new(5e-3, 5e-3, 20e-3))
                + Vec3::z() * 0.06
        });
        let mut observations = bench.observations(&[(Excitation::Uniform, places.collect())]);
        let instance = Instance { effect: effect(EffectId::ElementPhase), choice: Choice::None };
        let truth = bench.waves(0.7, 2.3);
        let model = ForwardModel::of(&[instance], std::slice::from_ref(&truth), &bench.context);
        read(&mut observations, &model);
        let start = Start { instances: vec![], values: vec![], spreads: vec![], nuisance: None };
        let found = fit(&observations, &bench.context, start, SEARCH);
        let left = found.chi_square / observations.len() as f64;
        assert!(left < 1.0, "{left}");
        // All phases may be turned together.
        let phases = &found.nuisance.departures[&EffectId::ElementPhase];
        let off: Vec<f64> = phases.iter().zip(&truth).map(|(found, truth)| found - truth).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let worst = off.iter().map(|off| (off - mean).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }
}
