//! Nonlinear least squares with normal priors: the Levenberg-Marquardt method.
//!
//! Minimises `Σ rᵢ(x)² + Σ ((xⱼ - meanⱼ)/sdⱼ)²` over a few parameters. Each parameter has a scale, the size of a significant change,
//! and is computed in units of it, so that metres and radians are comparable. The damping follows Marquardt (J. SIAM 11, 431, 1963)
//! with the update of Nielsen (IMM-REP-1999-05, eq. 2.4). Where derivatives are dear, they are carried from step to step by Broyden's rule
//! (Math. Comp. 19, 577, 1965). The same input gives the same bits on the same kind of processor.

mod curvature;
mod factor;
mod few_readings;
mod inner_products;
mod quadratic_model;
#[cfg(test)]
mod testing;

use nalgebra::DMatrix;

pub use factor::Factor;
use inner_products::inner_products_beside;
pub use inner_products::{dot, inner_products};
use quadratic_model::QuadraticModel;

/// A parameter of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Where the search starts.
    pub start: f64,
    /// The size of a significant change; above zero.
    pub scale: f64,
    /// Mean and standard deviation (above zero) of a normal prior; `None` without one.
    pub prior: Option<(f64, f64)>,
    /// Least and largest value; `None` without limits. The start is within them.
    pub range: Option<(f64, f64)>,
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
    /// Largest number of linearisations, carried ones included.
    pub iterations: usize,
    /// A step smaller than this, in scales of the parameters, ends the search, if the decrease that it is expected to bring is small too.
    pub step: f64,
    /// A relative decrease of the cost smaller than this ends the search.
    pub fall: f64,
    /// Steps in a row after which the derivatives are carried along and not computed: zero for none. They are computed after a step whose
    /// decrease they did not predict.
    pub carried: usize,
}

impl Default for Stopping {
    fn default() -> Self {
        Self { iterations: 50, step: 1e-7, fall: 1e-10, carried: 0 }
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
    /// By how much the cost would fall further in one undamped step, by the last derivatives; zero where they do not say.
    pub expected_fall: f64,
    /// Number of linearisations, carried ones included.
    pub iterations: usize,
    /// Whether the search ended by [`Stopping::step`] or [`Stopping::fall`] and not by the number of iterations.
    pub converged: bool,
}

/// Marquardt's damping at the start, relative to the largest curvature.
const DAMPING: f64 = 1e-3;

/// A damping at which steps are negligible.
const MAX_DAMPING: f64 = 1e12;

/// A decrease of the cost below which a step is immaterial: a tenth of what one standard deviation of one parameter makes. Many parameters, each moved by less
/// than matters alone, can decrease the cost by more.
const IMMATERIAL: f64 = 0.1;

/// Derivatives are carried on after a step whose decrease of the cost differs from the predicted one by less than this share: the curvature
/// that they lack is then small.
const PREDICTED: f64 = 0.25;

/// Finds a minimum, starting at the parameters' starts.
///
/// `residuals` gives the residuals at a point, and `linearise` residuals and derivatives. Residuals that are not finite mark a point
/// outside the model's domain, which is then not taken.
pub fn minimise(
    parameters: &[Parameter],
    stopping: Stopping,
    residuals: impl FnMut(&[f64]) -> Vec<f64>,
    linearise: impl FnMut(&[f64]) -> Linearisation,
) -> Minimum {
    minimise_from(parameters, stopping, None, residuals, linearise)
}

/// Residuals at the start of a search, and derivatives that may be those of a point nearby.
pub struct Known<'k> {
    /// Residuals and derivatives.
    pub linear: Linearisation,
    /// [Products](inner_products) of the first columns with one another, where they are known too.
    pub products: Option<&'k DMatrix<f64>>,
}

/// As [`minimise`], from what is known at the start.
pub fn minimise_from(
    parameters: &[Parameter],
    stopping: Stopping,
    known: Option<Known<'_>>,
    mut residuals: impl FnMut(&[f64]) -> Vec<f64>,
    mut linearise: impl FnMut(&[f64]) -> Linearisation,
) -> Minimum {
    let start: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    // How often the derivatives were carried since they were computed.
    let mut age = usize::from(known.is_some());
    let mut model = match known {
        Some(Known { linear, products }) => {
            QuadraticModel::new(parameters, start, linear, products)
        }
        None => {
            let linear = linearise(&start);
            QuadraticModel::new(parameters, start, linear, None)
        }
    };
    let mut damping = DAMPING * model.greatest_curvature();
    let mut growth = 2.0;
    let mut iterations = 1;
    let mut converged = false;
    while !converged && iterations < stopping.iterations {
        let Some(step) = model.step(damping) else { break };
        let predicted = step.predicted;
        let moved = residuals(&step.trial);
        let cost = squares(&moved) + prior_cost(parameters, &step.trial);
        let fall = model.cost - cost;
        let small = step.step.amax() < stopping.step && predicted < IMMATERIAL;
        if fall > 0.0 {
            converged = small || fall < stopping.fall * model.cost;
            let trusted = age < stopping.carried && (fall / predicted - 1.0).abs() < PREDICTED;
            if trusted && moved.len() == model.linear.residuals.len() {
                model = model.carried(step, moved);
                age += 1;
            } else {
                let linear = linearise(&step.trial);
                model = QuadraticModel::new(parameters, step.trial, linear, None);
                age = 0;
            }
            iterations += 1;
            damping *= (1.0 - (2.0 * fall / predicted - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0);
            growth = 2.0;
        } else if age > 0 && !small {
            // Perhaps not the step was too long, but the derivatives were those of another point.
            let linear = linearise(&model.at);
            model = QuadraticModel::new(parameters, model.at, linear, None);
            age = 0;
            iterations += 1;
        } else {
            converged = small || damping > MAX_DAMPING * model.greatest_curvature();
            damping *= growth;
            growth *= 2.0;
        }
    }
    let inverse = model.curvature.inverse(0.0, &[]);
    let expected_fall =
        inverse.as_ref().map_or(0.0, |inverse| model.downhill.dot(&inverse.times(&model.downhill)));
    let covariance = inverse.map(|inverse| model.covariance(&inverse));
    let QuadraticModel { at, cost, .. } = model;
    Minimum { parameters: at, cost, covariance, expected_fall, iterations, converged }
}

/// Where the cost of residuals as they are linearised about a point is least, and the covariance there; `None` where some combination of parameters changes
/// nothing. A parameter that would pass its limit ends there.
pub fn linear_minimum(
    parameters: &[Parameter],
    at: Vec<f64>,
    linear: Linearisation,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let model = QuadraticModel::new(parameters, at, linear, None);
    let covariance = model.covariance(&model.curvature.inverse(0.0, &[])?);
    Some((model.step(0.0)?.trial, covariance))
}

impl Parameter {
    /// Curvature of its prior, in its scale; zero without one.
    fn stiffness(&self) -> f64 {
        self.prior.map_or(0.0, |(_, sd)| (self.scale / sd).powi(2))
    }
}

fn squares(residuals: &[f64]) -> f64 {
    dot(residuals, residuals)
}

fn prior_cost(parameters: &[Parameter], at: &[f64]) -> f64 {
    let departure = |(p, x): (&Parameter, &f64)| p.prior.map_or(0.0, |(mean, sd)| (x - mean) / sd);
    parameters.iter().zip(at).map(departure).map(|d| d * d).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::testing::{decays, free};
    use super::*;

    fn run(parameters: &[Parameter], model: impl Fn(&[f64]) -> Linearisation) -> Minimum {
        let stopping = Stopping { iterations: 200, ..Stopping::default() };
        minimise(parameters, stopping, |x| model(x).residuals, &model)
    }

    /// A line through five points of a parabola.
    fn line(x: &[f64]) -> Linearisation {
        Linearisation {
            residuals: (0..5).map(|t| x[0] + x[1] * f64::from(t) - f64::from(t * t)).collect(),
            columns: vec![vec![1.0; 5], (0..5).map(f64::from).collect()],
        }
    }

    /// Of a line, one undamped step ends at the minimum, and beside it nothing is left to fall.
    #[test]
    fn the_expected_fall_is_what_is_left_above_the_minimum() {
        let prior = Some((2.0, 3.0));
        let parameters = [Parameter { prior, ..free(7.0, 0.1) }, free(-4.0, 10.0)];
        let from_start = Stopping { iterations: 1, ..Stopping::default() };
        let start = minimise(&parameters, from_start, |x| line(x).residuals, line);
        let least = run(&parameters, line);
        let above = start.cost - least.cost;
        assert!((start.expected_fall - above).abs() < 1e-6 * above, "{start:?} {least:?}");
        assert!(least.expected_fall < 1e-6, "{least:?}");
    }

    /// Forty parameters that a much better known one damps: each step moves none of them by what matters alone.
    #[test]
    fn steps_that_matter_only_together_do_not_end_a_search() {
        const OFF: f64 = 0.015;
        let parameters = vec![free(0.0, 1.0); 41];
        let model = |x: &[f64]| Linearisation {
            residuals: (0..41)
                .map(|n| if n == 0 { 1000.0 * x[0] } else { 10.0 * (x[n] - OFF) })
                .collect(),
            columns: (0..41)
                .map(|n| {
                    let mut column = vec![0.0; 41];
                    column[n] = if n == 0 { 1000.0 } else { 10.0 };
                    column
                })
                .collect(),
        };
        let stopping = Stopping { step: 2e-2, fall: 0.0, ..Stopping::default() };
        let found = minimise(&parameters, stopping, |x| model(x).residuals, model);
        assert!(found.converged && found.expected_fall < 0.2, "{found:?}");
    }

    /// Of residuals that are linear; a parameter at its limit stays there.
    #[test]
    fn the_linear_minimum_is_that_of_a_search() {
        let prior = Some((2.0, 3.0));
        let parameters = [Parameter { prior, ..free(7.0, 0.1) }, free(-4.0, 10.0)];
        let least = run(&parameters, line);
        let (at, covariance) =
            linear_minimum(&parameters, vec![7.0, -4.0], line(&[7.0, -4.0])).expect("determined");
        for n in 0..2 {
            assert!((at[n] - least.parameters[n]).abs() < 1e-6, "{at:?} {least:?}");
        }
        let of_search = least.covariance.expect("determined");
        assert!((covariance - &of_search).amax() < 1e-9 * of_search.amax());
        let limited = [Parameter { range: Some((6.0, 8.0)), ..parameters[0] }, parameters[1]];
        let (at, _) = linear_minimum(&limited, vec![7.0, -4.0], line(&[7.0, -4.0])).expect("one");
        assert_eq!(at[0], 6.0);
    }

    #[test]
    fn carried_derivatives_lead_to_the_same_minimum_with_fewer_computed_ones() {
        let parameters = [free(0.35, 0.01), free(1.1, 0.01), free(2.3, 0.01)];
        let with = |carried: usize, known: Option<Linearisation>| {
            let known = known.map(|linear| Known { linear, products: None });
            let mut computed = 0;
            let stopping = Stopping { carried, ..Stopping::default() };
            let minimum = minimise_from(
                &parameters,
                stopping,
                known,
                |x| decays(x).residuals,
                |x| {
                    computed += 1;
                    decays(x)
                },
            );
            assert!(minimum.converged);
            let found = minimum.parameters.iter().zip([0.3, 1.0, 2.5]);
            found.for_each(|(found, truth)| assert!((found - truth).abs() < 1e-5, "{minimum:?}"));
            computed
        };
        let each_time = with(0, None);
        assert!(with(3, None) < each_time, "of {each_time}");
        // Derivatives of a point nearby.
        let start = decays(&[0.35, 1.1, 2.3]);
        let nearby = Linearisation { columns: decays(&[0.33, 1.0, 2.4]).columns, ..start };
        assert!(with(3, Some(nearby)) < each_time, "of {each_time}");
    }

    /// Far from the minimum the valley bends: carried derivatives are recognised as wrong.
    #[test]
    fn a_bent_valley_is_followed_with_carried_derivatives_too() {
        let rosenbrock = |x: &[f64]| Linearisation {
            residuals: vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            columns: vec![vec![-20.0 * x[0], -1.0], vec![10.0, 0.0]],
        };
        let stopping = Stopping { iterations: 500, carried: 3, ..Stopping::default() };
        let start = [free(-1.2, 1.0), free(1.0, 1.0)];
        let wrong = Linearisation {
            columns: vec![vec![20.0, 1.0], vec![-10.0, 0.0]],
            ..rosenbrock(&[-1.2, 1.0])
        };
        for known in [None, Some(Known { linear: wrong, products: None })] {
            let minimum =
                minimise_from(&start, stopping, known, |x| rosenbrock(x).residuals, rosenbrock);
            assert!(minimum.parameters.iter().all(|p| (p - 1.0).abs() < 1e-5), "{minimum:?}");
        }
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
        let idle = Parameter { start: 0.3, scale: 1.0, prior: None, range: None };
        assert_eq!(run(&[free(0.0, 1.0), idle], model).covariance, None);
        let held = Parameter { prior: Some((0.25, 0.5)), ..idle };
        let minimum = run(&[free(0.0, 1.0), held], model);
        assert!((minimum.parameters[1] - 0.25).abs() < 1e-6);
        assert!((minimum.covariance.expect("held")[(1, 1)] - 0.25).abs() < 1e-12);
    }

    /// The sum of a hundred numbers is measured once: each takes its share of it, by its prior.
    #[test]
    fn many_numbers_share_what_few_readings_say() {
        const NUMBERS: usize = 100;
        let [sum, error, sd, scale] = [3.0, 0.2, 0.1, 0.05];
        let parameters =
            [Parameter { start: 0.0, scale, prior: Some((0.0, sd)), range: None }; NUMBERS];
        let minimum = run(&parameters, |x| Linearisation {
            residuals: vec![(x.iter().sum::<f64>() - sum) / error],
            columns: vec![vec![1.0 / error]; NUMBERS],
        });
        let all = NUMBERS as f64 * sd * sd + error * error;
        assert!(minimum.parameters.iter().all(|x| (x - sum * sd * sd / all).abs() < 1e-6));
        assert!((minimum.cost - sum * sum / all).abs() < 1e-6 * minimum.cost);
        let covariance = minimum.covariance.expect("priors");
        assert!((covariance[(3, 70)] + sd.powi(4) / all).abs() < 1e-9);
        assert!((covariance[(3, 3)] - sd * sd + sd.powi(4) / all).abs() < 1e-9);
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
            let parameter = Parameter { start: 0.0, scale: 0.7, prior: Some((mean, sd)), range: None };
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
