//! The curvature of half the cost about a point, in scales of the parameters, and its inverse.

use nalgebra::{DMatrix, DVector};

use super::few_readings::{FewReadings, Reduced};
use super::{Factor, Linearisation, Parameter, inner_products, inner_products_beside};

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

/// By how much derivatives were changed when they were carried along a step, all in scales of the parameters.
pub(super) struct Carried {
    /// Each column's share of what they had missed.
    pub share: DVector<f64>,
    /// What they had missed along each column, before the change.
    pub along: DVector<f64>,
    /// The square of what they had missed.
    pub square: f64,
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
