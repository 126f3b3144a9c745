//! Amplitudes or phases that differ from element to element: the spread with the greatest evidence.
//!
//! The departures are normal with one spread s, and integrated out. With g and H gradient and curvature of half the cost by the
//! departures, the logarithm of the evidence is ½ gᵀ(H + s⁻²)⁻¹ g - ½ ln det(1 + s² H), whose maximum gives the
//! spread.

use fieldgap_acoustics::least_squares::{Factor, Stopping};
use nalgebra::{DMatrix, DVector};

use crate::effect_id::EffectId;
use crate::fit::joint_fit::{Fit, Start, fit_beside};
use crate::fit::slopes::Slopes;
use crate::model::effect::{Context, PerElement};
use crate::model::instance::Instance;
use crate::model::observations::Observations;

/// Spreads that are tried first, from a thousandth upwards, by this factor.
const FACTOR: f64 = 1.5;

/// Spread that a fit begins with, if no fit before it found one.
const FIRST_SPREAD: f64 = 0.1;

/// Iterations between spread and departures.
const ROUNDS: usize = 4;

/// Fits a set whose instance `number` is random, its spread found with it. For `known` see [`fit_beside`].
pub(crate) fn fit_with_spread(
    observations: &Observations,
    context: &Context,
    start: Start,
    number: usize,
    stopping: Stopping,
    known: Option<&Slopes>,
) -> Fit {
    let mut start = start;
    let before = start.spreads[number];
    start.spreads[number] = if before.is_finite() { before } else { FIRST_SPREAD };
    let instances = start.instances.clone();
    let few = Stopping { iterations: 3, ..stopping };
    let mut fitted = fit_beside(observations, context, start, few, known);
    for round in 0..ROUNDS {
        let spread = better_spread(&fitted, number);
        let settled = (spread / fitted.spreads[number] - 1.0).abs() < 0.02;
        let mut spreads = fitted.spreads.clone();
        spreads[number] = spread;
        let again = Start {
            instances: instances.clone(),
            values: fitted.values.clone(),
            spreads,
            nuisance: Some(fitted.nuisance.clone()),
        };
        let stopping = if round + 1 == ROUNDS || settled { stopping } else { few };
        fitted = fit_beside(observations, context, again, stopping, known);
        if settled {
            break;
        }
    }
    fitted
}

/// A fit without its elements' departures of phase, which may be rounding of the driver; `None` if it has none.
pub(crate) fn without_phases(fit: &Fit) -> Option<Fit> {
    let of_phases = |instance: &Instance| instance.effect.facts().per_element == PerElement::Phase;
    let mut without = fit.clone();
    let departures = match fit.instances.iter().position(of_phases) {
        Some(number) => &mut without.values[number],
        None => without.nuisance.departures.get_mut(&EffectId::ElementPhase)?,
    };
    departures.fill(0.0);
    Some(without)
}

/// The spread with the greatest evidence, by the quadratic model about a fit.
fn better_spread(fit: &Fit, number: usize) -> f64 {
    let spread = fit.spreads[number];
    let range = fit.ranges()[number].clone();
    let Some(covariance) = &fit.covariance else { return spread };
    let block =
        covariance.view((range.start, range.start), (range.len(), range.len())).into_owned();
    let values = DVector::from_column_slice(&fit.values[number]);
    // The curvature by the readings alone, all else free: the inverse of the block less the prior.
    let Some(with_prior) = Factor::of(block).map(|factor| factor.inverse()) else { return spread };
    let curvature: DMatrix<f64> =
        &with_prior - DMatrix::identity(range.len(), range.len()) / (spread * spread);
    // At the fit the departures are (H + s⁻²)⁻¹ g.
    best_spread(curvature, &(with_prior * values)).0
}

/// The spread with the greatest evidence and its logarithm over that of none, from the curvature of half the cost by the
/// departures and its slope downhill where there are none.
pub(crate) fn best_spread(curvature: DMatrix<f64>, downhill: &DVector<f64>) -> (f64, f64) {
    let eigen = curvature.symmetric_eigen();
    let downhill = eigen.eigenvectors.transpose() * downhill;
    let log_evidence = |s: f64| -> f64 {
        eigen
            .eigenvalues
            .iter()
            .zip(&downhill)
            .map(|(h, g)| {
                let freed = 1.0 + s * s * h.max(0.0);
                0.5 * (g * g * s * s / freed - freed.ln())
            })
            .sum()
    };
    let of = |spread: f64| (spread, log_evidence(spread));
    let best = |scored: Vec<(f64, f64)>| {
        scored.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("some are tried")
    };
    let rough = best((0..20).map(|i| of(1e-3 * FACTOR.powi(i))).collect()).0;
    best((-5..=5).map(|i| of(rough * FACTOR.powf(f64::from(i) / 6.0))).collect())
}
