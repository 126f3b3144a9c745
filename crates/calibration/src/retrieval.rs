//! Phase retrieval: complex weights from amplitudes.
//!
//! The level of a coded drive is the modulus of a linear sum of the weights. Its square error is minimised by the Levenberg-Marquardt
//! method from several starts: the nominal array, which is near where most elements are sound, and arrays with random phases. A start
//! that ends elsewhere at the same cost would be a second solution.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::limits::{OUTLIER, SAME_SOLUTION};
use crate::model::{Model, Weights};
use fieldgap_acoustics::least_squares::{Stopping, minimise};

/// Departure of the phases and gains of a further start from the nominal ones, standard deviation, rad and relative: three times the
/// ordinary spread and more, yet within reach of the same solution.
const START_SPREAD: f64 = 0.6;

/// Where a search ended that began elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct StartOutcome {
    /// Squared residuals in units of the noise, per reading.
    pub chi_square: f64,
    /// Rms distance of its weights from the best ones, both turned to the same common phase.
    pub distance: f64,
    /// Whether it is the same solution.
    pub is_same: bool,
}

/// The weights that explain the readings best.
#[derive(Debug, Clone)]
pub struct Retrieval {
    /// The weights.
    pub weights: Weights,
    /// Covariance of all parameters, of the noise that the readings have; `None` if some are not determined.
    pub covariance: Option<DMatrix<f64>>,
    /// Squared residuals in units of the noise, per degree of freedom.
    pub chi_square: f64,
    /// Squared residuals and departures from the priors.
    pub cost: f64,
    /// Readings beyond six standard deviations, which were not used.
    pub outliers: usize,
    /// The starts other than the one that is kept.
    pub starts: Vec<StartOutcome>,
}

/// Finds the weights from one start.
pub fn retrieve(model: &Model<'_>, start: &Weights) -> Retrieval {
    // A step of 1e-4 of a weight is a hundredth of a usual error.
    retrieve_until(model, start, Stopping { iterations: 60, step: 1e-4, fall: 1e-7, carried: 0 })
}

/// The same as far as is needed to compare it with another model.
pub fn retrieve_roughly(model: &Model<'_>, start: &Weights) -> Retrieval {
    retrieve_until(model, start, Stopping { iterations: 12, step: 1e-3, fall: 1e-3, carried: 0 })
}

fn retrieve_until(model: &Model<'_>, start: &Weights, stopping: Stopping) -> Retrieval {
    let parameters = model.parameters(start);
    let minimum = minimise(&parameters, stopping, |x| model.residuals(x), |x| model.linearise(x));
    let residuals = model.residuals(&minimum.parameters);
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let free = effective_parameters(&parameters, minimum.covariance.as_ref());
    let freedom = (residuals.len() as f64 - free).max(1.0);
    let chi_square = squares / freedom;
    // Where the model leaves more than the noise, the errors are those of what it leaves.
    let covariance = minimum.covariance.map(|covariance| covariance * chi_square.max(1.0));
    Retrieval {
        weights: model.weights(&minimum.parameters),
        covariance,
        chi_square,
        cost: minimum.cost,
        outliers: 0,
        starts: Vec::new(),
    }
}

/// The same without the readings that lie far off it.
pub fn without_outliers<'a>(model: Model<'a>, found: Retrieval) -> (Model<'a>, Retrieval) {
    let predicted = model.predicted(&found.weights);
    let limit = OUTLIER * found.chi_square.sqrt().max(1.0);
    let is_off: Vec<bool> = model
        .rows()
        .iter()
        .zip(&predicted)
        .map(|(row, level)| (row.value - level).abs() > limit * model.sd(row))
        .collect();
    let outliers = is_off.iter().filter(|&&off| off).count();
    // More than a hundredth are no outliers, but a model that does not hold.
    if outliers == 0 || outliers * 100 > is_off.len() {
        return (model, found);
    }
    let model = model.keeping(|index| !is_off[index]);
    let again = retrieve(&model, &found.weights);
    (model, Retrieval { outliers, starts: found.starts, ..again })
}

/// Tries further starts, and keeps the best end.
pub fn from_several_starts(
    model: &Model<'_>,
    first: Retrieval,
    more: usize,
    seed: u64,
) -> Retrieval {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut ends = vec![first];
    for _ in 0..more {
        let mut start = model.nominal();
        for weight in &mut start.weights {
            // Box and Muller's pair of normal numbers.
            let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt() * START_SPREAD;
            let angle = TAU * random.random::<f64>();
            let gain = (1.0 + 0.5 * radius * angle.cos()).max(0.1);
            *weight = Complex64::from_polar(gain, radius * angle.sin());
        }
        ends.push(retrieve(model, &start));
    }
    let best = (0..ends.len()).min_by(|&a, &b| ends[a].cost.total_cmp(&ends[b].cost));
    let mut best = ends.swap_remove(best.expect("at least the first"));
    best.starts = ends
        .iter()
        .map(|end| {
            let distance = distance(&best.weights.weights, &end.weights.weights);
            StartOutcome { chi_square: end.chi_square, distance, is_same: distance < SAME_SOLUTION }
        })
        .collect();
    best
}

/// Rms distance of weights from others, turned to the same common phase.
pub fn distance(a: &[Complex64], b: &[Complex64]) -> f64 {
    let product: Complex64 = a.iter().zip(b).map(|(a, b)| a * b.conj()).sum();
    let turn = if product == Complex64::ZERO { Complex64::ONE } else { product / product.norm() };
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b * turn).norm_sqr()).sum();
    (squares / a.len() as f64).sqrt()
}

/// How many parameters the readings determine, and not their priors: the trace of the smoothing matrix.
fn effective_parameters(
    parameters: &[fieldgap_acoustics::least_squares::Parameter],
    covariance: Option<&DMatrix<f64>>,
) -> f64 {
    let Some(covariance) = covariance else { return parameters.len() as f64 };
    let of = |(k, parameter): (usize, &fieldgap_acoustics::least_squares::Parameter)| {
        1.0 - parameter.prior.map_or(0.0, |(_, sd)| covariance[(k, k)] / (sd * sd))
    };
    parameters.iter().enumerate().map(of).sum()
}
