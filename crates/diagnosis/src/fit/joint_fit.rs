//! A set of effects fitted to the readings, together with the gain and a small shift of each scan.

use fieldgap_acoustics::least_squares::{Minimum, Parameter as Unknown, Stopping, minimise_from};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

use crate::effect_id::EffectId;
use crate::fit::departures::{cost_of_departures, cost_of_spread, likeliest_spread};
use crate::fit::left::Left;
use crate::fit::nearly_linear::begun;
use crate::fit::problem::Problem;
use crate::fit::slopes::Slopes;
use crate::limits::{CARRIED, NEAR, NEAR_FIELD_PRIOR, REPEATED_PLACE_M, SAME_NEAR_FIELD};
use crate::model::effect::{Context, Estimate, Parameter, Search};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::{Nuisance, Nuisances};
use crate::model::observations::Observations;
use crate::statistics::fluctuation::Fluctuation;

/// A change of the shift that matters, m.
const SHIFT_SCALE_M: f64 = 2e-5;

/// A change of it that matters.
const NEAR_FIELD_SCALE: f64 = 0.05;

/// Steps for which the derivatives by the shifts, which change little, are kept: every step is tested on the residuals themselves.
const KEPT: usize = 4;

/// A change of the log gain that matters.
const GAIN_SCALE: f64 = 1e-3;

/// Several effects fitted together.
#[derive(Clone)]
pub(crate) struct Fit {
    /// The effects; empty for the believed set-up.
    pub instances: Vec<Instance>,
    /// The real parameters of each.
    pub values: Vec<Vec<f64>>,
    /// Spread of the elements' departures of each, where they are random; NaN for other effects, but for one whose prior is narrow: its width in
    /// scales of the parameters.
    pub spreads: Vec<f64>,
    /// What is free whatever the effects.
    pub nuisance: Nuisances,
    /// Twice the negative log likelihood, less a constant.
    pub cost: f64,
    /// The cost less what a scatter larger than the noise adds to it.
    pub chi_square: f64,
    /// The cost with the penalties of the priors.
    pub penalised: f64,
    /// The part of the penalties that is for the set-up: for shifts of the scans, and other departures within its stated uncertainty.
    pub of_setup: f64,
    /// Nats that the freedom of the set-up costs, by how much the readings narrow it.
    pub cost_of_departures: f64,
    /// Nats that the freedom of the elements which an effect lets depart costs beside it.
    pub cost_of_elements: f64,
    /// By how much the penalised cost would fall further in one step of the least squares.
    pub expected_fall: f64,
    /// What is left, by level; `None` where the noise is held, or the fit is not one of these readings.
    pub left: Option<Left>,
    /// Covariance: nuisance first, then the effects' parameters; `None` where some combination changes nothing.
    pub covariance: Option<DMatrix<f64>>,
}

impl Fit {
    /// No effect, not fitted.
    pub fn of_nothing(nuisance: impl Into<Nuisances>) -> Self {
        Self {
            instances: Vec::new(),
            values: Vec::new(),
            spreads: Vec::new(),
            nuisance: nuisance.into(),
            cost: f64::INFINITY,
            chi_square: f64::INFINITY,
            penalised: f64::INFINITY,
            of_setup: 0.0,
            cost_of_departures: 0.0,
            cost_of_elements: 0.0,
            expected_fall: 0.0,
            left: None,
            covariance: None,
        }
    }

    /// The forward model of the fit.
    pub fn model<'c>(&self, context: &'c Context) -> ForwardModel<'c> {
        let Self { instances, values, nuisance, .. } = self;
        ForwardModel::beside_departures(instances, values, &nuisance.departures, context)
    }

    /// The ids of the effects.
    pub fn ids(&self) -> Vec<EffectId> {
        self.instances.iter().map(|instance| instance.effect.id()).collect()
    }

    /// The cost with the penalties for the set-up. A displaced origin is absorbed by the shift; only its penalty then shows that the shift is
    /// larger than careful setting-up leaves.
    pub fn cost_with_setup(&self) -> f64 {
        self.cost + self.of_setup
    }

    /// The parameters of an effect; `None` without it.
    pub fn values_of(&self, id: EffectId) -> Option<&[f64]> {
        let mut active = self.instances.iter().zip(&self.values);
        active.find(|(instance, _)| instance.effect.id() == id).map(|(_, values)| values.as_slice())
    }

    /// These numbers of the fit, which stand so in the covariance, with their standard errors.
    pub fn estimates(&self, values: &[f64], range: Range<usize>) -> Vec<Estimate> {
        let error = |index: usize| {
            self.covariance
                .as_ref()
                .map_or(f64::NAN, |covariance| covariance[(index, index)].sqrt())
        };
        values
            .iter()
            .zip(range)
            .map(|(&value, index)| Estimate { value, error: error(index) })
            .collect()
    }

    /// Nats of likelihood that one of its effects gains over doing nothing, by the quadratic form of the cost; `None` where the form does not say.
    pub fn nats_of(&self, number: usize) -> Option<f64> {
        let range = self.ranges()[number].clone();
        let instance = &self.instances[number];
        if instance.effect.search() == Search::Random || range.is_empty() {
            return None;
        }
        let departures = self.values[number].iter().zip(instance.neutral());
        let departures = DVector::from_iterator(range.len(), departures.map(|(v, n)| v - n));
        let covariance = self.covariance.as_ref()?;
        let own = covariance.view((range.start, range.start), (range.len(), range.len()));
        let own = own.into_owned().cholesky()?;
        Some(0.5 * departures.dot(&own.solve(&departures)))
    }

    /// How many effects there are, the simulator's own defects not counted.
    pub fn physical_effects(&self) -> usize {
        self.instances.iter().filter(|instance| !instance.effect.is_defect()).count()
    }

    /// The fluctuation of the field that its effects make, with its cause; zero without such an effect.
    pub fn fluctuation(&self) -> (f64, Fluctuation) {
        let active = self.instances.iter().zip(&self.values);
        let mut found = active
            .filter_map(|(Instance { effect, choice }, values)| effect.fluctuation(values, choice));
        found.next().unwrap_or((0.0, Fluctuation::OfPaths))
    }

    /// Whether each element has a departure of its own.
    pub fn has_random_elements(&self) -> bool {
        self.instances.iter().any(|instance| instance.effect.search() == Search::Random)
    }

    /// Its other effects from where they are, to be fitted again.
    pub fn without(&self, number: usize) -> Self {
        let Self { mut instances, mut values, mut spreads, nuisance, .. } = self.clone();
        instances.remove(number);
        values.remove(number);
        spreads.remove(number);
        Self { instances, values, spreads, ..Self::of_nothing(nuisance) }
    }

    /// The same without one effect, not fitted again.
    pub fn less(mut self, number: usize, observations: &Observations, context: &Context) -> Self {
        self.instances.remove(number);
        self.values.remove(number);
        self.spreads.remove(number);
        self.covariance = None;
        self.cost_of_elements = 0.0;
        self.nuisance = self.nuisance.beside(&self.instances, &context.stated);
        let model = self.model(context);
        let pressures = model.pressures(observations, &self.nuisance);
        let residuals = model.residuals(observations, &pressures, &self.nuisance);
        let expected = model.received(observations, &pressures, &self.nuisance);
        let freedom = self.values.iter().map(Vec::len).sum::<usize>() as f64;
        self.left = context
            .common
            .is_none()
            .then(|| Left::of(observations, &residuals, &expected, freedom));
        self.cost = residuals.cost();
        Self { penalised: self.cost, ..self }
    }

    /// Some of its effects from where they are, to be fitted again.
    pub fn only(&self, ids: &[EffectId]) -> Self {
        let left_out =
            |fit: &Self| fit.instances.iter().position(|i| !ids.contains(&i.effect.id()));
        let mut part = self.clone();
        while let Some(number) = left_out(&part) {
            part = part.without(number);
        }
        part
    }

    /// The same with the effects in another order.
    pub fn in_order(self, order: &[usize]) -> Self {
        let ranges = self.ranges();
        let moved: Vec<usize> =
            (0..self.first()).chain(order.iter().flat_map(|&n| ranges[n].clone())).collect();
        let covariance = self.covariance.map(|covariance| {
            DMatrix::from_fn(moved.len(), moved.len(), |i, j| covariance[(moved[i], moved[j])])
        });
        Self {
            instances: order.iter().map(|&n| self.instances[n].clone()).collect(),
            values: order.iter().map(|&n| self.values[n].clone()).collect(),
            spreads: order.iter().map(|&n| self.spreads[n]).collect(),
            covariance,
            ..self
        }
    }

    /// Where the parameters of the effects begin in the covariance.
    pub fn first(&self) -> usize {
        self.departures().end
    }

    /// Where the numbers of the departures of the set-up are in the covariance.
    pub fn departures(&self) -> Range<usize> {
        let from = Nuisance::COUNT * self.nuisance.len();
        from..from + self.nuisance.departures.values().map(Vec::len).sum::<usize>()
    }

    /// Where the parameters of the effects begin and end in the covariance.
    pub fn ranges(&self) -> Vec<Range<usize>> {
        let mut from = self.first();
        self.values
            .iter()
            .map(|values| {
                let range = from..from + values.len();
                from = range.end;
                range
            })
            .collect()
    }
}

/// What to fit and from where.
#[derive(Clone)]
pub(crate) struct Start {
    /// The effects.
    pub instances: Vec<Instance>,
    /// Their parameters to begin with.
    pub values: Vec<Vec<f64>>,
    /// As those of a [`Fit`].
    pub spreads: Vec<f64>,
    /// What is free whatever the effects, to begin with; without it the set-up as stated, and the gain that fits best.
    pub nuisance: Option<Nuisances>,
}

impl From<Fit> for Start {
    /// From where a fit ended.
    fn from(fit: Fit) -> Self {
        let Fit { instances, values, spreads, nuisance, .. } = fit;
        Self { instances, values, spreads, nuisance: Some(nuisance) }
    }
}

/// Fits a set of effects from a start.
pub(crate) fn fit(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
) -> Fit {
    fit_beside(observations, context, start, stopping, None)
}

/// The same with the derivatives of these readings by the first of the parameters, or near values of them, where they are known.
pub(crate) fn fit_beside(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
    known: Option<&Slopes>,
) -> Fit {
    if !observations.have_phases() {
        return descended(observations, context, start, stopping, known);
    }
    let first = descended(observations, context, start.clone(), stopping, known);
    if is_near(first.chi_square, observations) {
        return first;
    }
    // Phases that are off by more than half a turn lead astray, amplitudes alone leave signs open: each leads where the other does not.
    let Fit { values, nuisance, .. } =
        descended(&observations.without_phases(), context, start.clone(), stopping, None);
    let from_there = Start { values, nuisance: Some(nuisance), ..start };
    let other = descended(observations, context, from_there, stopping, None);
    if other.penalised < first.penalised { other } else { first }
}

/// Downhill from a start.
fn descended(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
    known: Option<&Slopes>,
) -> Fit {
    let Start { instances, values, spreads, nuisance } = start;
    let nuisance = nuisance.unwrap_or_else(|| {
        let near_field = context.common.as_ref().map_or(0.0, |common| common.near_field);
        ForwardModel::of(&instances, &values, context).best_gain(observations, near_field).into()
    });
    let nuisance = nuisance.beside(&instances, &context.stated);
    let mut unknowns = unknowns(&instances, &values, &spreads, &nuisance, context);
    let problem = Problem::new(observations, context, &instances, &values);
    problem.limit(&mut unknowns);
    let mut kept = None;
    let mut age = 0;
    let mut at: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    // Near the readings their signs are right.
    let lacks_signs = known.is_none()
        && !observations.have_phases()
        && !problem.layout.random_ranges().is_empty()
        && !problem.depends_on_arrival(&at)
        && !is_near(problem.evaluate(&at).residuals.chi_square(), observations);
    if lacks_signs {
        at = begun(&problem, &unknowns, &at);
        unknowns.iter_mut().zip(&at).for_each(|(unknown, &start)| unknown.start = start);
    }
    let Minimum { parameters, cost: penalised, covariance, expected_fall, .. } = minimise_from(
        &unknowns,
        stopping,
        known.and_then(|known| problem.beside_known(known, &at, &unknowns)),
        |numbers| problem.at(numbers),
        |numbers| {
            if age % KEPT == 0 {
                kept = None;
            }
            age += 1;
            problem.linearise(numbers, &unknowns, &mut kept)
        },
    );
    let evaluation = problem.evaluate(&parameters);
    let residuals = &evaluation.residuals;
    let constant = evaluation.squared.iter().map(|r| r * r).sum::<f64>() - residuals.cost();
    let determined = |(n, unknown): (usize, &Unknown)| match (&covariance, unknown.prior) {
        (Some(covariance), Some((_, sd))) => 1.0 - covariance[(n, n)] / (sd * sd),
        _ => 1.0,
    };
    let freedom = unknowns.iter().enumerate().map(determined).sum();
    // Between two records the noise is that of both, which their own readings tell.
    let left = context.common.is_none().then(|| problem.left(&evaluation, freedom));
    let spreads_found = nuisance.spreads;
    let mut nuisance = problem.layout.nuisances(&parameters);
    let mut rest = parameters[problem.layout.first()..].to_vec();
    let of_setup = |(n, unknown): (usize, &Unknown)| match unknown.prior {
        Some((mean, sd)) if is_of_setup(n, nuisance.len()) => ((parameters[n] - mean) / sd).powi(2),
        _ => 0.0,
    };
    let of_setup = unknowns[..problem.layout.first()].iter().enumerate().map(of_setup).sum();
    let is_freed = |n: &usize| {
        let is_shift = *n < Nuisance::COUNT * nuisance.len();
        is_of_setup(*n, nuisance.len()) && (!is_shift || context.stated.has_wide_origin())
    };
    let freed: Vec<usize> = (0..problem.layout.first()).filter(is_freed).collect();
    let is_random = problem.layout.random_ranges();
    let (of_elements, smooth): (Vec<usize>, Vec<usize>) = (problem.layout.first()..unknowns.len())
        .partition(|n| is_random.iter().any(|range| range.contains(n)));
    // Departures of all kinds together: each by itself would seem better known than they are, or be charged for what another makes up for.
    let cost = |departures: &[usize]| {
        cost_of_departures(covariance.as_ref(), &unknowns, departures, &smooth)
    };
    let mut cost_of_departures = cost(&freed);
    let cost_of_elements = match of_elements.is_empty() {
        true => 0.0,
        false => cost(&[freed, of_elements].concat()) - cost_of_departures,
    };
    for (stated, range) in problem.layout.spread_departures() {
        let spread = stated.spread(&spreads_found);
        cost_of_departures += cost_of_spread(spread, stated.priors[0].1);
        let square = |n: usize| {
            parameters[n].powi(2) + covariance.as_ref().map_or(0.0, |covariance| covariance[(n, n)])
        };
        // For the fits that go on from here.
        let squares = range.clone().map(square).sum();
        let now = likeliest_spread(squares, range.len(), stated.priors[0].1);
        nuisance.spreads.insert(stated.id(), now);
    }
    let values =
        problem.layout.lengths.iter().map(|&length| rest.drain(..length).collect()).collect();
    Fit {
        cost: residuals.cost(),
        chi_square: residuals.chi_square(),
        penalised: penalised - constant,
        of_setup,
        cost_of_departures,
        cost_of_elements,
        expected_fall,
        left,
        instances,
        values,
        spreads,
        nuisance,
        covariance,
    }
}

/// The unknowns of a fit: nuisance first, with the departures of the set-up, then the effects' parameters.
pub(crate) fn unknowns(
    instances: &[Instance],
    values: &[Vec<f64>],
    spreads: &[f64],
    nuisance: &Nuisances,
    context: &Context,
) -> Vec<Unknown> {
    let mut unknowns = Vec::new();
    let (shift_m, near_field) = match &context.common {
        None => (context.stated.origin_m(), NEAR_FIELD_PRIOR),
        Some(common) => (REPEATED_PLACE_M, (common.near_field, SAME_NEAR_FIELD)),
    };
    for nuisance in nuisance.iter() {
        unknowns.push(Unknown {
            start: nuisance.log_gain,
            scale: GAIN_SCALE,
            prior: None,
            range: None,
        });
        let prior = Some((0.0, shift_m));
        let shifts = nuisance.shift_m.iter().map(|&start| (start, SHIFT_SCALE_M));
        unknowns.extend(shifts.map(|(start, scale)| Unknown { start, scale, prior, range: None }));
        let (start, prior) = (nuisance.near_field, Some(near_field));
        unknowns.push(Unknown { start, scale: NEAR_FIELD_SCALE, prior, range: None });
    }
    for departure in context.stated.beside(instances) {
        let values = &nuisance.departures[&departure.id()];
        let Instance { effect, choice } = &departure.instance;
        let is_random = departure.is_of_elements();
        let spread = departure.spread(&nuisance.spreads);
        let mut parameters = effect.parameters_of(choice).iter();
        for (&start, &prior) in values.iter().zip(&departure.priors) {
            unknowns.push(match parameters.next().filter(|_| !is_random) {
                Some(parameter) => Unknown { prior: Some(prior), ..unknown(start, parameter, 1.0) },
                None => Unknown { scale: spread, ..of_element(start, spread) },
            });
        }
    }
    unknowns.extend(unknowns_of_effects(instances, values, spreads));
    unknowns
}

/// Those of the effects alone.
pub(crate) fn unknowns_of_effects(
    instances: &[Instance],
    values: &[Vec<f64>],
    spreads: &[f64],
) -> Vec<Unknown> {
    let mut unknowns = Vec::new();
    for ((instance, values), spread) in instances.iter().zip(values).zip(spreads) {
        if instance.effect.search() == Search::Random {
            unknowns.extend(values.iter().map(|&start| of_element(start, *spread)));
        } else {
            let parameters = instance.effect.parameters_of(&instance.choice);
            unknowns.extend(values.iter().zip(parameters).map(|(v, p)| unknown(*v, p, *spread)));
        }
    }
    unknowns
}

/// The departure of one element, of which this is the standard deviation before any reading.
fn of_element(start: f64, spread: f64) -> Unknown {
    Unknown { start, scale: 0.01, prior: Some((0.0, spread)), range: None }
}

/// Whether so much chi-square leaves little more than noise.
pub(crate) fn is_near(chi_square: f64, observations: &Observations) -> bool {
    chi_square < NEAR.get() * observations.len() as f64
}

/// Whether a number of what is free in every fit is one of the set-up: neither gain nor near field of one of so many scans.
fn is_of_setup(number: usize, scans: usize) -> bool {
    number >= Nuisance::COUNT * scans || (1..=3).contains(&(number % Nuisance::COUNT))
}

/// `scales` is the width of the prior, in scales of the parameter, where it has one.
fn unknown(start: f64, parameter: &Parameter, scales: f64) -> Unknown {
    // The plausible range is else a very wide prior. It only separates parameters that the data do not.
    let (width, range) = match scales.is_finite() {
        true => (scales * parameter.scale, Some((parameter.least, parameter.most))),
        false => (parameter.most - parameter.least, None),
    };
    Unknown { start, scale: parameter.scale, prior: Some((parameter.neutral, width)), range }
}

/// When a fit within the search stops: at two hundredths of a standard deviation, far below the errors of the formulas.
pub(crate) const SEARCH: Stopping =
    Stopping { iterations: 12, step: 2e-2, fall: 1e-6, carried: CARRIED };

/// The cost of a fit on other readings.
pub(crate) fn cost_on(observations: &Observations, fit: &Fit, context: &Context) -> f64 {
    let model = fit.model(context);
    let pressures = model.pressures(observations, &fit.nuisance);
    model.residuals(observations, &pressures, &fit.nuisance).cost()
}

#[cfg(test)]
mod tests;
