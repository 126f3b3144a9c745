//! The curvature of half the cost about a point, in scales of the parameters, and its inverse.

use nalgebra::{DMatrix, DVector};

use super::few_readings::{FewReadings, Reduced};
use super::{Carried, Factor, Linearisation, Parameter, inner_products, inner_products_beside};

/// In the form that is solved with fewer operations.
pub(super) enum Curvature {
    /// Of each parameter with each.
    OfParameters(DMatrix<f64>),
    /// Of far fewer residuals than parameters.
    OfReadings(FewReadings),
}

/// The inverse of a damped curvature, ready to be applied.
pub(super) enum Inverse<'c> {
    OfParameters(Factor),
    OfReadings(Reduced<'c>),
}

impl Curvature {
    /// `known` are the products of the first columns with one another.
    pub fn of(
        parameters: &[Parameter],
        linear: &Linearisation,
        known: Option<&DMatrix<f64>>,
    ) -> Self {
        if let Some(few) = FewReadings::of(parameters, linear) {
            return Self::OfReadings(few);
        }
        let scales = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| p.scale));
        let products = match known {
            Some(known) => inner_products_beside(known, &linear.columns),
            None => inner_products(&linear.columns),
        };
        let mut curvature = products.component_mul(&(&scales * scales.transpose()));
        for (j, parameter) in parameters.iter().enumerate() {
            curvature[(j, j)] += parameter.stiffness();
        }
        Self::OfParameters(curvature)
    }

    /// After its derivatives were carried along a step, in scales of the parameters.
    pub fn carried(
        self,
        parameters: &[Parameter],
        linear: &Linearisation,
        carried: &Carried,
    ) -> Self {
        let Self::OfParameters(mut curvature) = self else {
            return Self::of(parameters, linear, None);
        };
        let Carried { share, along, square } = carried;
        curvature.ger(1.0, share, along, 1.0);
        curvature.ger(1.0, along, share, 1.0);
        curvature.ger(*square, share, share, 1.0);
        Self::OfParameters(curvature)
    }

    /// The inverse, with a damping in each direction, and with some parameters held; `None` where some combination of parameters changes nothing.
    pub fn inverse(&self, damping: f64, held: &[usize]) -> Option<Inverse<'_>> {
        match self {
            Self::OfParameters(curvature) => {
                let mut damped = curvature.clone();
                (0..damped.nrows()).for_each(|j| damped[(j, j)] += damping);
                hold(&mut damped, held);
                Some(Inverse::OfParameters(Factor::of(damped)?))
            }
            Self::OfReadings(few) => Some(Inverse::OfReadings(few.reduced(damping, held)?)),
        }
    }
}

impl Inverse<'_> {
    /// Times a vector, which is zero for parameters that are held.
    pub fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::OfParameters(factor) => factor.solve(vector),
            Self::OfReadings(reduced) => reduced.solve(vector),
        }
    }

    /// The whole inverse.
    pub fn matrix(&self) -> DMatrix<f64> {
        match self {
            Self::OfParameters(factor) => factor.inverse(),
            Self::OfReadings(reduced) => reduced.inverse(),
        }
    }
}

/// Takes some parameters out of a curvature.
pub(super) fn hold(curvature: &mut DMatrix<f64>, held: &[usize]) {
    for &j in held {
        curvature.row_mut(j).fill(0.0);
        curvature.column_mut(j).fill(0.0);
        curvature[(j, j)] = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::least_squares::Step;

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
