//! What readings say of an effect before it is fitted: how they would change with it, and what it promises.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::effects::{Choice, Context, Effect};
use super::fit::{Fit, Instance, unknowns};
use super::observations::Observations;
use super::problem::{Looked, Problem};
use crate::least_squares::{Linearisation, Parameter as Unknown, dot};

/// What the readings say, to first order, about effects that are not yet in a fit.
pub(super) struct Promises<'o> {
    pub observations: &'o Observations,
    pub context: &'o Context,
    fit: &'o Fit,
    numbers: Vec<f64>,
    unknowns: Vec<Unknown>,
    linear: Linearisation,
    looked: Arc<Looked>,
}

/// The quadratic model of half the cost in an effect's own parameters, all else fitted anew.
pub(super) struct Promise {
    /// Slope, downhill.
    pub downhill: DVector<f64>,
    /// Curvature by the readings alone.
    pub curvature: DMatrix<f64>,
}

impl<'o> Promises<'o> {
    /// Linearises a fit once, for all effects that may be added to it.
    pub fn of(observations: &'o Observations, context: &'o Context, fit: &'o Fit) -> Self {
        let unknowns = unknowns(&fit.instances, &fit.values, &fit.spreads, &fit.nuisance);
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = Problem::new(observations, context, &fit.instances, &fit.values);
        let linear = problem.linearise(&numbers, &unknowns, &mut None);
        let looked = problem.look(&numbers);
        Self { observations, context, fit, numbers, unknowns, linear, looked }
    }

    /// The derivatives by what is fitted already, a column each, and below them a row for each that is known beforehand: one over
    /// its standard deviation.
    pub fn known_columns(&self) -> DMatrix<f64> {
        let readings = self.linear.residuals.len();
        let rows = readings + self.unknowns.len();
        let mut columns = DMatrix::zeros(rows, self.unknowns.len());
        for (j, (column, unknown)) in self.linear.columns.iter().zip(&self.unknowns).enumerate() {
            columns.view_mut((0, j), (readings, 1)).copy_from_slice(column);
            columns[(readings + j, j)] = unknown.prior.map_or(0.0, |(_, sd)| 1.0 / sd);
        }
        columns
    }

    /// The derivatives by the parameters of an effect, at values at which it must do nothing yet.
    pub fn columns_of(&self, effect: &'static dyn Effect, values: &[f64]) -> Vec<Vec<f64>> {
        let mut instances = self.fit.instances.clone();
        instances.push(Instance { effect, choice: Choice::None });
        let mut all = self.fit.values.clone();
        all.push(values.to_vec());
        let mut spreads = self.fit.spreads.clone();
        spreads.push(1.0);
        let problem = Problem::new(self.observations, self.context, &instances, &all);
        let unknowns = unknowns(&instances, &all, &spreads, &self.fit.nuisance);
        let mut numbers = self.numbers.clone();
        numbers.extend(values);
        let range = self.numbers.len()..numbers.len();
        problem.columns(&numbers, &unknowns, range, &self.looked)
    }

    /// What an effect promises that begins with these values, at which it must do nothing yet.
    pub fn of_effect(&self, effect: &'static dyn Effect, values: &[f64]) -> Promise {
        let known = self.numbers.len();
        let residuals = &self.linear.residuals;
        let columns = self.columns_of(effect, values);
        let old = &self.linear.columns;
        let mut within = DMatrix::from_fn(known, known, |i, j| dot(&old[i], &old[j]));
        for (i, unknown) in self.unknowns.iter().enumerate() {
            if let Some((_, sd)) = unknown.prior {
                within[(i, i)] += 1.0 / (sd * sd);
            }
        }
        let across = DMatrix::from_fn(known, columns.len(), |i, j| dot(&old[i], &columns[j]));
        let own =
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| dot(&columns[i], &columns[j]));
        let downhill = DVector::from_iterator(
            columns.len(),
            columns.iter().map(|column| -dot(column, residuals)),
        );
        // The fit is at its minimum: what is already in it has no slope left, only a curvature that it shares.
        let curvature = match within.cholesky() {
            Some(cholesky) => &own - across.transpose() * cholesky.solve(&across),
            None => own,
        };
        Promise { downhill, curvature }
    }
}
