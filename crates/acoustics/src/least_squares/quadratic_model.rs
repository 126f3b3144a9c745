//! The quadratic model of the cost about a point, its damped steps, and derivatives carried along a step.

use nalgebra::{DMatrix, DVector};

use super::curvature::{Carried, Curvature, Inverse};
use super::inner_products::dot;
use super::{Linearisation, Parameter, prior_cost, squares};

impl Linearisation {
    /// Moves to a point where the residuals are known: the least change of the derivatives, in scales of the parameters, by which they
    /// give the difference of the residuals along the step (Broyden, eq. 4.5).
    fn carry(&mut self, moved: Vec<f64>, parameters: &[Parameter], step: &Step) -> Carried {
        let mut missed = moved.clone();
        missed.iter_mut().zip(&self.residuals).for_each(|(missed, before)| *missed -= before);
        for (column, change) in self.columns.iter().zip(&step.change) {
            missed.iter_mut().zip(column).for_each(|(missed, slope)| *missed -= slope * change);
        }
        let share = &step.step / step.step.norm_squared().max(f64::MIN_POSITIVE);
        let of_each = self.columns.iter_mut().zip(parameters).zip(&share);
        let along = of_each.map(|((column, parameter), share)| {
            let along = dot(column, &missed) * parameter.scale;
            let share = share / parameter.scale;
            column.iter_mut().zip(&missed).for_each(|(slope, missed)| *slope += share * missed);
            along
        });
        let along = DVector::from_iterator(parameters.len(), along);
        self.residuals = moved;
        Carried { share, along, square: squares(&missed) }
    }
}

/// The quadratic model of the cost about a point, in scales of the parameters.
pub(super) struct QuadraticModel<'p> {
    parameters: &'p [Parameter],
    pub at: Vec<f64>,
    pub linear: Linearisation,
    pub curvature: Curvature,
    pub downhill: DVector<f64>,
    pub cost: f64,
}

impl<'p> QuadraticModel<'p> {
    /// `known` are the products of the first columns with one another.
    pub fn new(
        parameters: &'p [Parameter],
        at: Vec<f64>,
        linear: Linearisation,
        known: Option<&DMatrix<f64>>,
    ) -> Self {
        let curvature = Curvature::of(parameters, &linear, known);
        Self::with(parameters, at, linear, curvature)
    }

    fn with(
        parameters: &'p [Parameter],
        at: Vec<f64>,
        linear: Linearisation,
        curvature: Curvature,
    ) -> Self {
        let downhill = |(j, parameter): (usize, &Parameter)| {
            let by_readings = -dot(&linear.columns[j], &linear.residuals) * parameter.scale;
            let by_prior = |(mean, sd): (f64, f64)| (mean - at[j]) / sd * parameter.scale / sd;
            by_readings + parameter.prior.map_or(0.0, by_prior)
        };
        let downhill = parameters.iter().enumerate().map(downhill);
        let downhill = DVector::from_iterator(parameters.len(), downhill);
        let cost = squares(&linear.residuals) + prior_cost(parameters, &at);
        Self { parameters, at, linear, curvature, downhill, cost }
    }

    /// The same after a step to a point with these residuals, its derivatives carried along.
    pub fn carried(self, step: Step, moved: Vec<f64>) -> Self {
        let Self { parameters, mut linear, curvature, .. } = self;
        let carried = linear.carry(moved, parameters, &step);
        let curvature = curvature.carried(parameters, &linear, &carried);
        Self::with(parameters, step.trial, linear, curvature)
    }

    /// The covariance of the parameters in their own units, from the inverse of the curvature.
    pub fn covariance(&self, inverse: &Inverse<'_>) -> DMatrix<f64> {
        let scales = self.parameters.iter().map(|parameter| parameter.scale);
        let scales = DVector::from_iterator(self.parameters.len(), scales);
        inverse.matrix().component_mul(&(&scales * scales.transpose()))
    }

    /// The largest curvature in the direction of a parameter.
    pub fn greatest_curvature(&self) -> f64 {
        let of_each = self.parameters.iter().zip(&self.linear.columns);
        let curvature = |(parameter, column): (&Parameter, &Vec<f64>)| {
            squares(column) * parameter.scale * parameter.scale + parameter.stiffness()
        };
        of_each.map(curvature).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// The damped step. A parameter at a limit stays there where downhill is beyond it, and none passes its limit.
    pub fn step(&self, damping: f64) -> Option<Step> {
        let Self { parameters, at, .. } = self;
        let mut downhill = self.downhill.clone();
        let mut held = Vec::new();
        for (j, (parameter, x)) in parameters.iter().zip(at).enumerate() {
            let Some((least, most)) = parameter.range else { continue };
            if *x <= least && downhill[j] < 0.0 || *x >= most && downhill[j] > 0.0 {
                held.push(j);
                downhill[j] = 0.0;
            }
        }
        let mut step = self.curvature.inverse(damping, &held)?.times(&downhill);
        let mut change: Vec<f64> = parameters.iter().zip(&step).map(|(p, s)| s * p.scale).collect();
        let mut trial: Vec<f64> = at.iter().zip(&change).map(|(x, change)| x + change).collect();
        let mut limited = false;
        for (j, parameter) in parameters.iter().enumerate() {
            let Some((least, most)) = parameter.range else { continue };
            let within = trial[j].clamp(least, most);
            if within != trial[j] {
                limited = true;
                trial[j] = within;
                change[j] = within - at[j];
                step[j] = change[j] / parameter.scale;
            }
        }
        // The decrease that the linear model predicts.
        let predicted = match limited {
            false => step.dot(&(damping * &step + &self.downhill)),
            true => 2.0 * step.dot(&self.downhill) - self.bend(&step, &change),
        };
        Some(Step { step, change, trial, predicted })
    }

    /// The square of the change of residuals and priors along a step.
    fn bend(&self, step: &DVector<f64>, change: &[f64]) -> f64 {
        let mut moved = vec![0.0; self.linear.residuals.len()];
        for (column, change) in self.linear.columns.iter().zip(change) {
            moved.iter_mut().zip(column).for_each(|(moved, slope)| *moved += slope * change);
        }
        let priors = self.parameters.iter().zip(step);
        squares(&moved) + priors.map(|(p, step)| p.stiffness() * step * step).sum::<f64>()
    }
}

/// A step of the search.
pub(super) struct Step {
    /// In scales of the parameters.
    pub step: DVector<f64>,
    /// The same in the parameters' own units.
    change: Vec<f64>,
    /// Where it leads.
    pub trial: Vec<f64>,
    /// The decrease of the cost that the linear model predicts.
    pub predicted: f64,
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::testing::{decays, free};
    use super::*;

    #[test]
    fn a_carried_derivative_gives_the_difference_along_the_step() {
        let mut linear = decays(&[0.4, 0.9, 2.0]);
        let (before, scales) = (linear.residuals.clone(), [0.01, 0.1, 1.0]);
        let step = DVector::from_vec(vec![3.0, 0.0, -0.2]);
        let change: Vec<f64> = step.iter().zip(scales).map(|(step, scale)| step * scale).collect();
        let still = linear.columns[1].clone();
        let moved = decays(&[0.4 + change[0], 0.9, 2.0 + change[2]]).residuals;
        let parameters = scales.map(|scale| free(0.0, scale));
        let step = Step { step, change: change.clone(), trial: Vec::new(), predicted: 0.0 };
        linear.carry(moved.clone(), &parameters, &step);
        assert_eq!(linear.columns[1], still);
        for i in 0..moved.len() {
            let along: f64 =
                linear.columns.iter().zip(&change).map(|(c, change)| c[i] * change).sum();
            assert!((before[i] + along - moved[i]).abs() < 1e-12);
        }
    }

    /// Of 2 (x + y - 3) and x - y, with x at most one: unbounded both are 1.5; at the limit the least is at y = 1.8.
    #[test]
    fn no_step_passes_a_limit_and_its_decrease_is_foretold() {
        let model = |x: &[f64]| Linearisation {
            residuals: vec![2.0 * (x[0] + x[1] - 3.0), x[0] - x[1]],
            columns: vec![vec![2.0, 1.0], vec![2.0, -1.0]],
        };
        let bounded = Parameter { range: Some((-1.0, 1.0)), ..free(0.0, 0.1) };
        let parameters = [bounded, free(0.0, 10.0)];
        let step_from = |at: [f64; 2]| {
            let model = QuadraticModel::new(&parameters, at.to_vec(), model(&at), None);
            (model.cost, model.step(0.0).expect("both matter"))
        };
        let (cost, towards) = step_from([0.8, 0.1]);
        let [x, y] = [towards.trial[0], towards.trial[1]];
        assert!(x == 1.0 && (y - 1.5).abs() < 1e-9, "{x} {y}");
        let fell = cost - squares(&model(&towards.trial).residuals);
        assert!((towards.predicted - fell).abs() < 1e-9, "{} {fell}", towards.predicted);
        let (_, along) = step_from([1.0, 0.1]);
        let [x, y] = [along.trial[0], along.trial[1]];
        assert!(x == 1.0 && (y - 1.8).abs() < 1e-9, "{x} {y}");
    }

    /// Of few parameters and of many, against the curvature by the carried derivatives.
    #[test]
    fn a_carried_curvature_is_that_of_the_carried_derivatives() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for count in [3, 70] {
            let mut numbers = |count: usize| -> Vec<f64> {
                (0..count).map(|_| random.random_range(-2.0..2.0)).collect()
            };
            let parameters: Vec<Parameter> = (0..count)
                .map(|j| Parameter {
                    start: 0.0,
                    scale: 0.1 + j as f64,
                    prior: Some((0.0, 7.0)),
                    range: None,
                })
                .collect();
            let columns: Vec<Vec<f64>> = (0..count).map(|_| numbers(100)).collect();
            let mut linear = Linearisation { residuals: numbers(100), columns };
            let before = Curvature::of(&parameters, &linear, None);
            let step = DVector::from_vec(numbers(count));
            let change = step.iter().zip(&parameters).map(|(step, p)| step * p.scale).collect();
            let step = Step { step, change, trial: Vec::new(), predicted: 0.0 };
            let carried = linear.carry(numbers(100), &parameters, &step);
            let carried = before.carried(&parameters, &linear, &carried);
            let of = |curvature: Curvature| match curvature {
                Curvature::OfParameters(curvature) => curvature,
                Curvature::OfReadings(_) => panic!("there are enough readings"),
            };
            let [carried, anew] = [carried, Curvature::of(&parameters, &linear, None)].map(of);
            assert!((carried - &anew).amax() < 1e-10 * anew.amax());
        }
    }
}
