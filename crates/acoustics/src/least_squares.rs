//! Nonlinear least squares with normal priors: the Levenberg-Marquardt method.
//!
//! Minimises `Σ rᵢ(x)² + Σ ((xⱼ - meanⱼ)/sdⱼ)²` over a few parameters. Each parameter has a scale, the size of a significant change,
//! and is computed in units of it, so that metres and radians are comparable. The damping follows Marquardt (J. SIAM 11, 431, 1963)
//! with the update of Nielsen (IMM-REP-1999-05, eq. 2.4). Sums are taken in the order of the residuals: the same input gives the same
//! bits.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A parameter of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Where the search starts.
    pub start: f64,
    /// The size of a significant change; above zero.
    pub scale: f64,
    /// Mean and standard deviation (above zero) of a normal prior; `None` without one.
    pub prior: Option<(f64, f64)>,
}

/// Residuals at a point and their derivatives by each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// The residuals, in units of their standard deviation.
    pub residuals: Vec<f64>,
    /// Derivatives of all residuals by each parameter: one column for each parameter.
    pub columns: Vec<Vec<f64>>,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    /// Largest number of linearisations.
    pub iterations: usize,
    /// A step smaller than this, in scales of the parameters, ends the search.
    pub step: f64,
    /// A relative decrease of the cost smaller than this ends the search.
    pub fall: f64,
}

impl Default for Stopping {
    fn default() -> Self {
        Self { iterations: 50, step: 1e-7, fall: 1e-10 }
    }
}

/// Where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The parameters.
    pub parameters: Vec<f64>,
    /// The cost: squared residuals plus squared deviations from the priors.
    pub cost: f64,
    /// Inverse of half the cost's curvature: the covariance of the parameters, if the residuals are independent and of unit variance.
    /// `None` if some combination of parameters does not change the residuals.
    pub covariance: Option<DMatrix<f64>>,
    /// Number of linearisations.
    pub iterations: usize,
    /// Whether the search ended by [`Stopping::step`] or [`Stopping::fall`] and not by the number of iterations.
    pub converged: bool,
}

/// Marquardt's damping at the start, relative to the largest curvature.
const DAMPING: f64 = 1e-3;

/// Parameters from which on the normal equations are formed by several threads.
const MANY: usize = 64;

/// A damping at which steps are negligible.
const MAX_DAMPING: f64 = 1e12;

/// Finds a minimum, starting at the parameters' starts.
///
/// `residuals` gives the residuals at a point, and `linearise` residuals and derivatives. Residuals that are not finite mark a point
/// outside the model's domain, which is then not taken.
pub fn minimise(
    parameters: &[Parameter],
    stopping: Stopping,
    mut residuals: impl FnMut(&[f64]) -> Vec<f64>,
    mut linearise: impl FnMut(&[f64]) -> Linearisation,
) -> Minimum {
    let mut at: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    let mut normal = NormalEquations::new(parameters, &at, &linearise(&at));
    let mut damping = DAMPING * normal.curvature.diagonal().amax().max(f64::MIN_POSITIVE);
    let mut growth = 2.0;
    let mut iterations = 1;
    let mut converged = false;
    while !converged && iterations < stopping.iterations {
        let Some(step) = normal.step(damping) else { break };
        let trial: Vec<f64> =
            at.iter().zip(parameters).zip(step.iter()).map(|((x, p), s)| x + s * p.scale).collect();
        let cost = squares(&residuals(&trial)) + prior_cost(parameters, &trial);
        // The decrease that the linear model predicts.
        let predicted = step.dot(&(damping * &step + &normal.downhill));
        let fall = normal.cost - cost;
        let small = step.amax() < stopping.step;
        if fall > 0.0 {
            converged = small || fall < stopping.fall * normal.cost;
            at = trial;
            normal = NormalEquations::new(parameters, &at, &linearise(&at));
            iterations += 1;
            damping *= (1.0 - (2.0 * fall / predicted - 1.0).powi(3)).max(1.0 / 3.0);
            growth = 2.0;
        } else {
            let scale = normal.curvature.diagonal().amax().max(f64::MIN_POSITIVE);
            converged = small || damping > MAX_DAMPING * scale;
            damping *= growth;
            growth *= 2.0;
        }
    }
    let scales = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| p.scale));
    let covariance = normal.curvature.clone().cholesky().map(|cholesky| {
        let scaled = cholesky.inverse();
        scaled.component_mul(&(&scales * scales.transpose()))
    });
    Minimum { parameters: at, cost: normal.cost, covariance, iterations, converged }
}

/// The quadratic model of the cost about a point, in scales of the parameters.
struct NormalEquations {
    curvature: DMatrix<f64>,
    downhill: DVector<f64>,
    cost: f64,
}

impl NormalEquations {
    fn new(parameters: &[Parameter], at: &[f64], linear: &Linearisation) -> Self {
        let n = parameters.len();
        let mut curvature = DMatrix::zeros(n, n);
        let mut downhill = DVector::zeros(n);
        let products = |j: usize| -> Vec<f64> {
            linear.columns[..=j].iter().map(|column| dot(column, &linear.columns[j])).collect()
        };
        // Each product is a sum of its own, so threads do not change it. Few are not worth a task.
        let products: Vec<Vec<f64>> = if n < MANY {
            (0..n).map(products).collect()
        } else {
            (0..n).into_par_iter().map(products).collect()
        };
        for (j, parameter) in parameters.iter().enumerate() {
            for (i, other) in parameters.iter().enumerate().take(j + 1) {
                let entry = products[j][i] * other.scale * parameter.scale;
                curvature[(i, j)] = entry;
                curvature[(j, i)] = entry;
            }
            downhill[j] = -dot(&linear.columns[j], &linear.residuals) * parameter.scale;
            if let Some((mean, sd)) = parameter.prior {
                curvature[(j, j)] += (parameter.scale / sd).powi(2);
                downhill[j] -= (at[j] - mean) / sd * parameter.scale / sd;
            }
        }
        let cost = squares(&linear.residuals) + prior_cost(parameters, at);
        Self { curvature, downhill, cost }
    }

    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let damped =
            &self.curvature + DMatrix::identity(self.downhill.len(), self.downhill.len()) * damping;
        damped.cholesky().map(|cholesky| cholesky.solve(&self.downhill))
    }
}

fn squares(residuals: &[f64]) -> f64 {
    dot(residuals, residuals)
}

/// Scalar product, in eight partial sums that the processor computes together; always in the same order.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

fn prior_cost(parameters: &[Parameter], at: &[f64]) -> f64 {
    let departure = |(p, x): (&Parameter, &f64)| p.prior.map_or(0.0, |(mean, sd)| (x - mean) / sd);
    parameters.iter().zip(at).map(departure).map(|d| d * d).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn free(start: f64, scale: f64) -> Parameter {
        Parameter { start, scale, prior: None }
    }

    fn run(parameters: &[Parameter], model: impl Fn(&[f64]) -> Linearisation) -> Minimum {
        let stopping = Stopping { iterations: 200, ..Stopping::default() };
        minimise(parameters, stopping, |x| model(x).residuals, &model)
    }

    /// Residuals (10 (y - x²), 1 - x): minimum zero at (1, 1), along a bent valley.
    #[test]
    fn rosenbrocks_minimum_is_found() {
        let minimum = run(&[free(-1.2, 1.0), free(1.0, 1.0)], |x| Linearisation {
            residuals: vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            columns: vec![vec![-20.0 * x[0], -1.0], vec![10.0, 0.0]],
        });
        assert!(minimum.converged);
        assert!(minimum.parameters.iter().all(|p| (p - 1.0).abs() < 1e-6), "{minimum:?}");
    }

    /// A straight line through n points at 0, 1, … has the textbook's covariance.
    #[test]
    fn a_straight_line_has_the_closed_forms_parameters_and_covariance() {
        let n = 10;
        let at: Vec<f64> = (0..n).map(f64::from).collect();
        let minimum = run(&[free(0.0, 1e-3), free(0.0, 10.0)], |p| Linearisation {
            residuals: at.iter().map(|x| p[0] + p[1] * x - (2.0 - 3.0 * x)).collect(),
            columns: vec![vec![1.0; at.len()], at.clone()],
        });
        assert!((minimum.parameters[0] - 2.0).abs() < 1e-6);
        assert!((minimum.parameters[1] + 3.0).abs() < 1e-6);
        let covariance = minimum.covariance.expect("two points would do");
        let squares: f64 = at.iter().map(|x| (x - 4.5).powi(2)).sum();
        assert!((covariance[(1, 1)] - 1.0 / squares).abs() < 1e-12);
        assert!((covariance[(0, 0)] - (1.0 / f64::from(n) + 4.5 * 4.5 / squares)).abs() < 1e-12);
        assert!((covariance[(0, 1)] + 4.5 / squares).abs() < 1e-12);
    }

    #[test]
    fn a_parameter_that_changes_nothing_has_no_covariance_unless_a_prior_holds_it() {
        let model = |p: &[f64]| Linearisation {
            residuals: vec![p[0] - 1.0],
            columns: vec![vec![1.0], vec![0.0]],
        };
        let idle = Parameter { start: 0.3, scale: 1.0, prior: None };
        assert_eq!(run(&[free(0.0, 1.0), idle], model).covariance, None);
        let held = Parameter { prior: Some((0.25, 0.5)), ..idle };
        let minimum = run(&[free(0.0, 1.0), held], model);
        assert!((minimum.parameters[1] - 0.25).abs() < 1e-6);
        assert!((minimum.covariance.expect("held")[(1, 1)] - 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_step_outside_the_models_domain_is_not_taken() {
        // ln x = 0 from far right: the first Newton step lands at a negative x.
        let minimum = run(&[free(8.0, 1.0)], |p| Linearisation {
            residuals: vec![p[0].ln()],
            columns: vec![vec![1.0 / p[0]]],
        });
        assert!(minimum.converged && (minimum.parameters[0] - 1.0).abs() < 1e-6, "{minimum:?}");
    }

    proptest! {
        /// One measurement and one prior: the posterior mean weighs them by their precisions.
        #[test]
        fn measurement_and_prior_are_weighted_by_their_precisions(
            measured in -5.0..5.0f64, error in 0.1..3.0f64, mean in -5.0..5.0f64, sd in 0.1..3.0f64,
        ) {
            let parameter = Parameter { start: 0.0, scale: 0.7, prior: Some((mean, sd)) };
            let minimum = run(&[parameter], |p| Linearisation {
                residuals: vec![(p[0] - measured) / error],
                columns: vec![vec![1.0 / error]],
            });
            let precision = error.powi(-2) + sd.powi(-2);
            let expected = (measured * error.powi(-2) + mean * sd.powi(-2)) / precision;
            prop_assert!((minimum.parameters[0] - expected).abs() < 1e-5);
            prop_assert!((minimum.covariance.expect("fixed")[(0, 0)] * precision - 1.0).abs() < 1e-9);
        }
    }
}
