//! Amplitudes or phases that differ from element to element: the spread that the readings speak for.
//!
//! The departures are normal with one spread s, and integrated out. With g and H gradient and curvature of half the cost by the
//! departures, the logarithm of the evidence is ½ gᵀ(H + s⁻²)⁻¹ g - ½ ln det(1 + s² H), which has its maximum at the
//! spread that is taken.

use nalgebra::{DMatrix, DVector};

use super::effects::Context;
use super::fit::{Fit, Start, fit};
use super::observations::Observations;
use crate::gap::levenberg_marquardt::Stopping;

/// Spreads that are tried first, from a thousandth upwards, by this factor.
const FACTOR: f64 = 1.5;

/// Rounds in which spread and departures settle.
const ROUNDS: usize = 4;

/// Fits a set whose instance `number` is random, its spread found with it.
pub(super) fn fit_with_spread(
    observations: &Observations,
    context: &Context,
    start: Start,
    number: usize,
    stopping: Stopping,
) -> Fit {
    let mut start = start;
    start.spreads[number] = 0.1;
    let instances = start.instances.clone();
    let few = Stopping { iterations: 3, ..stopping };
    let mut fitted = fit(observations, context, start, few);
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
        fitted = fit(observations, context, again, stopping);
        if settled {
            break;
        }
    }
    fitted
}

/// The spread with the greatest evidence, by the quadratic model about a fit.
fn better_spread(fit: &Fit, number: usize) -> f64 {
    let spread = fit.spreads[number];
    let range = fit.ranges()[number].clone();
    let Some(covariance) = &fit.covariance else { return spread };
    let block =
        covariance.view((range.start, range.start), (range.len(), range.len())).into_owned();
    let values = DVector::from_column_slice(&fit.values[number]);
    // The curvature by the readings alone, all else free: the inverse of the block less what the prior put there.
    let Some(with_prior) = block.cholesky().map(|c| c.inverse()) else { return spread };
    let curvature: DMatrix<f64> =
        &with_prior - DMatrix::identity(range.len(), range.len()) / (spread * spread);
    // At the fit the departures are (H + s⁻²)⁻¹ g.
    best_spread(curvature, &(with_prior * values)).0
}

/// The spread with the greatest evidence and its logarithm over that of none, from the curvature of half the cost by the
/// departures and its slope downhill where there are none.
pub(super) fn best_spread(curvature: DMatrix<f64>, downhill: &DVector<f64>) -> (f64, f64) {
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
    let best = |tried: Vec<(f64, f64)>| {
        tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("some are tried")
    };
    let rough = best((0..20).map(|i| of(1e-3 * FACTOR.powi(i))).collect()).0;
    best((-5..=5).map(|i| of(rough * FACTOR.powf(f64::from(i) / 6.0))).collect())
}
