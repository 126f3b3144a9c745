//! Rao's score statistic: what the readings say of an effect before it is fitted.

use fieldgap_acoustics::least_squares::{
    Factor, Linearisation, Parameter as Unknown, dot, inner_products,
};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use std::sync::Arc;

use crate::fit::joint_fit::{Fit, unknowns, unknowns_of_effects};
use crate::fit::problem::{Evaluation, Problem};
use crate::fit::slopes::Slopes;
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;

/// What the readings say, to first order, about effects that are not yet in a fit.
pub(crate) struct ScoreStatistics<'o> {
    pub observations: &'o Observations,
    pub context: &'o Context,
    pub fit: &'o Fit,
    numbers: Vec<f64>,
    unknowns: Vec<Unknown>,
    residuals: Vec<f64>,
    slopes: Slopes,
    evaluation: Arc<Evaluation>,
    /// The curvature in the fitted parameters, decomposed; `None` where some combination of it changes nothing.
    within: Option<Factor>,
}

/// The quadratic model of half the cost in an effect's own parameters, all else fitted anew.
pub(crate) struct ScoreStatistic {
    /// Slope, downhill.
    pub downhill: DVector<f64>,
    /// Curvature by the readings alone.
    pub curvature: DMatrix<f64>,
    /// Its diagonal if nothing else were fitted.
    pub alone: DVector<f64>,
}

impl ScoreStatistic {
    /// That of all directions but the last, which is fitted beside them with a prior of mean zero and this standard deviation.
    pub fn beside_last(self, sd: f64) -> Self {
        let count = self.downhill.len() - 1;
        let own = self.curvature[(count, count)] + 1.0 / (sd * sd);
        let across = self.curvature.view((0, count), (count, 1)).into_owned();
        let kept = |all: &DVector<f64>| all.rows(0, count).into_owned();
        Self {
            downhill: kept(&self.downhill) - &across * (self.downhill[count] / own),
            curvature: self.curvature.view((0, 0), (count, count))
                - &across * across.transpose() / own,
            alone: kept(&self.alone),
        }
    }

    /// The expected decrease of the cost; `None` where some direction changes nothing.
    pub fn gained(&self) -> Option<f64> {
        self.gained_beside(0.0)
    }

    /// The same, robust against errors of the derivatives: a direction counts only if more than this share of it is not imitated by
    /// the fitted parameters.
    pub fn gained_beside(&self, share: f64) -> Option<f64> {
        let curvature = &self.curvature + DMatrix::from_diagonal(&(share * &self.alone));
        Some(self.downhill.dot(&curvature.cholesky()?.solve(&self.downhill)))
    }
}

impl<'o> ScoreStatistics<'o> {
    /// Linearises a fit once, for all effects that may be added to it.
    pub fn of(observations: &'o Observations, context: &'o Context, fit: &'o Fit) -> Self {
        let unknowns = unknowns(&fit.instances, &fit.values, &fit.spreads, &fit.nuisance, context);
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = Problem::new(observations, context, &fit.instances, &fit.values);
        let Linearisation { residuals, columns } =
            problem.linearise(&numbers, &unknowns, &mut None);
        let slopes = Slopes::of(columns);
        let evaluation = problem.evaluate(&numbers);
        let mut within = slopes.products().clone();
        for (i, unknown) in unknowns.iter().enumerate() {
            if let Some((_, sd)) = unknown.prior {
                within[(i, i)] += 1.0 / (sd * sd);
            }
        }
        let within = Factor::of(within);
        Self {
            observations,
            context,
            fit,
            numbers,
            unknowns,
            residuals,
            slopes,
            evaluation,
            within,
        }
    }

    /// The derivatives by the fitted parameters.
    pub fn slopes(&self) -> &Slopes {
        &self.slopes
    }

    /// The same, taken out.
    pub fn into_slopes(self) -> Slopes {
        self.slopes
    }

    /// The derivatives by the fitted parameters, one column each. Below them stands one row for each prior: one over its standard deviation.
    pub fn known_columns(&self) -> DMatrix<f64> {
        let readings = self.residuals.len();
        let rows = readings + self.unknowns.len();
        let mut columns = DMatrix::zeros(rows, self.unknowns.len());
        for (j, (column, unknown)) in self.slopes.columns().iter().zip(&self.unknowns).enumerate() {
            columns.view_mut((0, j), (readings, 1)).copy_from_slice(column);
            columns[(readings + j, j)] = unknown.prior.map_or(0.0, |(_, sd)| 1.0 / sd);
        }
        columns
    }

    /// The derivatives by the parameters of an effect, at neutral values.
    pub fn columns_of(&self, effect: &'static dyn Effect, values: &[f64]) -> Vec<Vec<f64>> {
        let mut instances = self.fit.instances.clone();
        instances.push(Instance { effect, choice: Choice::None });
        let mut all = self.fit.values.clone();
        all.push(values.to_vec());
        // A departure of the set-up of the same kind stays beside it.
        let problem = Problem::new(self.observations, self.context, &instances, &all)
            .with_departures_beside(&self.fit.instances);
        let mut unknowns = self.unknowns.clone();
        let last = self.fit.instances.len();
        unknowns.extend(unknowns_of_effects(&instances[last..], &all[last..], &[1.0]));
        let mut numbers = self.numbers.clone();
        numbers.extend(values);
        let range = self.numbers.len()..numbers.len();
        problem.columns(&numbers, &unknowns, range, &self.evaluation)
    }

    /// The derivatives by the fitted parameters except departures of single elements, each with its name.
    pub fn smooth_columns(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let nuisance = Nuisance::NAMES.into_iter().cycle();
        let nuisance = nuisance.take(Nuisance::COUNT * self.fit.nuisance.len());
        let Fit { instances, values, nuisance: beside, .. } = self.fit;
        let stated = self.context.stated.beside(instances);
        let stated = stated.map(|of| (&of.instance, &beside.departures[&of.id()]));
        let of_effects =
            stated.chain(instances.iter().zip(values)).flat_map(|(instance, values)| {
                let name = Some(instance.effect.id().as_str())
                    .filter(|_| instance.effect.search() != Search::Random);
                values.iter().map(move |_| name)
            });
        let names = nuisance.map(Some).chain(of_effects);
        names
            .zip(self.slopes.columns())
            .filter_map(|(name, column)| Some((name?, column.as_slice())))
    }

    /// The derivatives by the shifts of all scans together, along x, y and z.
    pub fn shift_columns(&self) -> [Vec<f64>; 3] {
        [1, 2, 3].map(|number| {
            let scans = (0..self.fit.nuisance.len()).map(|n| Nuisance::COUNT * n + number);
            let columns = scans.map(|number| &self.slopes.columns()[number]);
            let mut sum = vec![0.0; self.residuals.len()];
            columns.for_each(|column| sum.iter_mut().zip(column).for_each(|(s, c)| *s += c));
            sum
        })
    }

    /// How each residual changes with the pressure of its reading: by the real part of this times the change.
    pub fn by_pressure(&self) -> Vec<Complex64> {
        let problem =
            Problem::new(self.observations, self.context, &self.fit.instances, &self.fit.values);
        problem.slopes(&self.numbers, &self.evaluation)[..self.observations.len()].to_vec()
    }

    /// The statistic of an effect at neutral values.
    pub fn of_effect(&self, effect: &'static dyn Effect, values: &[f64]) -> ScoreStatistic {
        self.of_columns(&self.columns_of(effect, values))
    }

    /// The statistic of a change of the residuals along these columns.
    pub fn of_columns(&self, columns: &[Vec<f64>]) -> ScoreStatistic {
        let known = self.numbers.len();
        let residuals = &self.residuals;
        let old = self.slopes.columns();
        let across = DMatrix::from_fn(known, columns.len(), |i, j| dot(&old[i], &columns[j]));
        let own = inner_products(columns);
        let mut downhill = DVector::from_iterator(
            columns.len(),
            columns.iter().map(|column| -dot(column, residuals)),
        );
        // Remove the part shared with the fitted parameters, and their slope where the fit is not quite at its minimum.
        let curvature = match &self.within {
            Some(within) => {
                let known_downhill = DVector::from_fn(known, |i, _| {
                    let prior = self.unknowns[i].prior;
                    let back = prior.map_or(0.0, |(mean, sd)| (mean - self.numbers[i]) / (sd * sd));
                    back - dot(&old[i], residuals)
                });
                downhill -= across.tr_mul(&within.solve(&known_downhill));
                let whitened = within.whitened(&across);
                &own - whitened.transpose() * &whitened
            }
            None => own.clone(),
        };
        ScoreStatistic { downhill, curvature, alone: own.diagonal() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A direction that is known is not fitted, and one that is free is projected out.
    #[test]
    fn the_last_direction_is_fitted_as_far_as_its_prior_allows() {
        let statistic = || ScoreStatistic {
            downhill: DVector::from_vec(vec![1.0, 2.0]),
            curvature: DMatrix::from_row_slice(2, 2, &[4.0, 2.0, 2.0, 3.0]),
            alone: DVector::from_vec(vec![4.0, 3.0]),
        };
        let gained = |sd| statistic().beside_last(sd).gained().expect("a slope");
        assert!((gained(1e-6) - 1.0 / 4.0).abs() < 1e-9, "{}", gained(1e-6));
        let (downhill, curvature) = (1.0 - 2.0 * 2.0 / 3.0, 4.0 - 2.0 * 2.0 / 3.0);
        assert!((gained(1e6) - downhill * downhill / curvature).abs() < 1e-9, "{}", gained(1e6));
    }
}
