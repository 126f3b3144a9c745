//! A set of effects fitted to the readings, with gain and a small shift of each scan beside them.

use std::cell::RefCell;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::gap::levenberg_marquardt::{
    self, Linearisation, Minimum, Parameter as Unknown, Stopping, minimise,
};

use super::effects::{Choice, Context, Effect, Parameter, Search, turbulence};
use super::likelihood::{Nuisance, Pressures, Residuals, first_gain, pressures};
use super::observations::Observations;
use super::random_elements::fit_with_spread;
use super::supposed::{Speckle, Supposed};

/// An effect with what was chosen for it.
#[derive(Clone)]
pub(super) struct Instance {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// What was chosen.
    pub choice: Choice,
}

/// Standard deviation of the shift that setting up leaves, m: a tenth of a millimetre. A wider one would eat the
/// effects that move a field.
pub(super) const SHIFT_M: f64 = 1e-4;

/// A change of the shift that matters, m.
const SHIFT_SCALE_M: f64 = 2e-5;

/// What is known of the elements' near field beforehand, mean and standard deviation: nothing of it, or a piston's.
const NEAR_FIELD: (f64, f64) = (0.5, 0.5);

/// A change of it that matters.
const NEAR_FIELD_SCALE: f64 = 0.05;

/// Steps for which the derivatives by the shifts are kept: they only point the way, which every step is tested on.
const KEPT: usize = 4;

/// A change of the log gain that matters.
const GAIN_SCALE: f64 = 1e-3;

/// Share of a parameter's scale that its difference quotient steps: far above rounding, far below curvature.
const DIFFERENCE: f64 = 1e-3;

/// Several effects fitted together.
#[derive(Clone)]
pub(super) struct Fit {
    /// The effects; empty for the believed set-up.
    pub instances: Vec<Instance>,
    /// The real parameters of each.
    pub values: Vec<Vec<f64>>,
    /// Spread of the elements' departures of each, where they are random.
    pub spreads: Vec<f64>,
    /// Gain and shift of each scan.
    pub nuisance: Vec<Nuisance>,
    /// Twice the negative log likelihood, less a constant.
    pub cost: f64,
    /// The same and the departures from what is known beforehand.
    pub penalised: f64,
    /// Covariance: nuisance first, then the effects' parameters; `None` where some combination changes nothing.
    pub covariance: Option<DMatrix<f64>>,
}

impl Fit {
    /// The believed set-up, not fitted.
    pub fn of_nothing(nuisance: Vec<Nuisance>) -> Self {
        Self {
            instances: Vec::new(),
            values: Vec::new(),
            spreads: Vec::new(),
            nuisance,
            cost: f64::INFINITY,
            penalised: f64::INFINITY,
            covariance: None,
        }
    }

    /// What is supposed.
    pub fn supposed(&self, context: &Context) -> Supposed {
        suppose(&self.instances, &self.values, context)
    }

    /// The ids of the effects.
    pub fn ids(&self) -> Vec<&'static str> {
        self.instances.iter().map(|instance| instance.effect.id()).collect()
    }

    /// Random phase over one metre of path, rad, and the kind of speckle it makes.
    pub fn turbulence(&self) -> (f64, Speckle) {
        let is_turbulence = |instance: &Instance| instance.effect.id() == "turbulence";
        match self.instances.iter().position(is_turbulence) {
            Some(number) => {
                (self.values[number][0], turbulence::speckle(&self.instances[number].choice))
            }
            None => (0.0, Speckle::OfPaths),
        }
    }

    /// Whether each element has a departure of its own.
    pub fn has_random_elements(&self) -> bool {
        self.instances.iter().any(|instance| instance.effect.search() == Search::Random)
    }

    /// Where the parameters of the effects' begin and end in the covariance.
    pub fn ranges(&self) -> Vec<Range<usize>> {
        let mut from = Nuisance::COUNT * self.nuisance.len();
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

fn suppose(instances: &[Instance], values: &[Vec<f64>], context: &Context) -> Supposed {
    let mut supposed = Supposed::default();
    for (instance, values) in instances.iter().zip(values) {
        instance.effect.suppose(values, &instance.choice, context, &mut supposed);
    }
    supposed
}

/// What to fit and from where.
pub(super) struct Start {
    /// The effects.
    pub instances: Vec<Instance>,
    /// Their parameters to begin with.
    pub values: Vec<Vec<f64>>,
    /// Spread of the elements' departures of each, where they are random.
    pub spreads: Vec<f64>,
    /// Gain and shift to begin with; without it the gain that fits best.
    pub nuisance: Option<Vec<Nuisance>>,
}

/// The problem that a search works on.
struct Problem<'o> {
    observations: &'o Observations,
    context: &'o Context,
    instances: &'o [Instance],
    lengths: Vec<usize>,
    /// Where the residuals were looked at last, and the pressures there.
    last: RefCell<Option<(Vec<f64>, Pressures)>>,
}

impl<'o> Problem<'o> {
    fn new(
        observations: &'o Observations,
        context: &'o Context,
        instances: &'o [Instance],
        values: &[Vec<f64>],
    ) -> Self {
        let lengths = values.iter().map(Vec::len).collect();
        Self { observations, context, instances, lengths, last: RefCell::new(None) }
    }

    fn nuisance(&self, numbers: &[f64]) -> Vec<Nuisance> {
        numbers[..Nuisance::COUNT * self.observations.scans.len()]
            .chunks(Nuisance::COUNT)
            .map(Nuisance::from_slice)
            .collect()
    }

    fn supposed(&self, numbers: &[f64]) -> Supposed {
        let mut rest = &numbers[Nuisance::COUNT * self.observations.scans.len()..];
        let mut supposed = Supposed::default();
        for (instance, &length) in self.instances.iter().zip(&self.lengths) {
            let (values, after) = rest.split_at(length);
            instance.effect.suppose(values, &instance.choice, self.context, &mut supposed);
            rest = after;
        }
        supposed
    }

    fn pressures(&self, numbers: &[f64]) -> Pressures {
        pressures(self.observations, &self.supposed(numbers), &self.nuisance(numbers))
    }

    fn residuals(&self, numbers: &[f64], pressures: &Pressures) -> Residuals {
        self.supposed(numbers).residuals(self.observations, pressures, &self.nuisance(numbers))
    }

    /// Residuals at a point, NaN where a parameter has left what is plausible.
    fn at(&self, numbers: &[f64]) -> Vec<f64> {
        if !self.plausible(numbers) {
            return vec![f64::NAN];
        }
        let pressures = self.pressures(numbers);
        let residuals = self.residuals(numbers, &pressures).for_least_squares();
        self.last.replace(Some((numbers.to_vec(), pressures)));
        residuals
    }

    /// The pressures at a point, taken where the residuals were looked at last if that was there.
    fn pressures_again(&self, numbers: &[f64]) -> Pressures {
        let last = self.last.take().filter(|(at, _)| at == numbers);
        last.map_or_else(|| self.pressures(numbers), |(_, pressures)| pressures)
    }

    fn plausible(&self, numbers: &[f64]) -> bool {
        let mut at = Nuisance::COUNT * self.observations.scans.len();
        self.instances.iter().zip(&self.lengths).all(|(instance, length)| {
            let values = &numbers[at..at + length];
            at += length;
            is_plausible(self.observations, self.context, instance, values)
        })
    }

    /// Residuals and derivatives; those by the scans' shifts, which change little on the way, are taken from `kept` where
    /// that holds them.
    fn linearise(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        kept: &mut Option<Vec<Vec<f64>>>,
    ) -> Linearisation {
        let pressures = self.pressures_again(numbers);
        let residuals = self.residuals(numbers, &pressures).for_least_squares();
        let of = |range| self.columns(numbers, unknowns, range, &pressures, &residuals);
        let nuisance = Nuisance::COUNT * self.observations.scans.len();
        let mut columns = match kept.take().filter(|kept| kept[0].len() == residuals.len()) {
            Some(mut columns) => {
                for gain in (0..nuisance).step_by(Nuisance::COUNT) {
                    columns[gain] = of(gain..gain + 1).remove(0);
                }
                columns
            }
            None => of(0..nuisance),
        };
        *kept = Some(columns.clone());
        columns.extend(of(nuisance..numbers.len()));
        Linearisation { residuals, columns }
    }

    /// Derivatives of the residuals by some of the numbers.
    fn columns(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        range: Range<usize>,
        base_pressures: &Pressures,
        residuals: &[f64],
    ) -> Vec<Vec<f64>> {
        let base = self.supposed(numbers);
        let base_field = base.field_alone();
        let random = self.random_ranges();
        let mut contributions: Option<Vec<Vec<Vec<Complex64>>>> = None;
        let mut slopes: Option<Vec<Complex64>> = None;
        range
            .map(|j| {
                let mut beside = numbers.to_vec();
                let mut step = DIFFERENCE * unknowns[j].scale;
                beside[j] += step;
                if !self.plausible(&beside) {
                    step = -step;
                    beside[j] = numbers[j] + step;
                }
                let shifts =
                    j < Nuisance::COUNT * self.observations.scans.len() && j % Nuisance::COUNT != 0;
                let supposed = self.supposed(&beside);
                let plain = !supposed.minds_the_way() && !supposed.changes_scatter();
                if let Some(range) = random.iter().find(|r| r.contains(&j)).filter(|_| plain) {
                    let parts = contributions.get_or_insert_with(|| self.contributions(numbers));
                    let slopes = slopes
                        .get_or_insert_with(|| self.slopes(numbers, base_pressures, residuals));
                    let change = change_of_weight(j - range.start, &base, &supposed) / step;
                    return along_element(slopes, parts, j - range.start, change);
                }
                let pressures = if let Some(range) = random.iter().find(|r| r.contains(&j)) {
                    let parts = contributions.get_or_insert_with(|| self.contributions(numbers));
                    turned(base_pressures, parts, j - range.start, &base, &supposed)
                } else if shifts || supposed.field_alone() != base_field {
                    self.pressures(&beside)
                } else {
                    base_pressures.clone()
                };
                let moved = self.residuals(&beside, &pressures).for_least_squares();
                moved.iter().zip(residuals).map(|(m, r)| (m - r) / step).collect()
            })
            .collect()
    }

    /// How each residual changes with its pressure: the derivative by a change dp is the real part of slope times dp.
    fn slopes(&self, numbers: &[f64], pressures: &Pressures, residuals: &[f64]) -> Vec<Complex64> {
        const LOUDER: f64 = 1e-6;
        let mut louder = pressures.clone();
        let all = louder.iter_mut().flatten().flatten();
        all.for_each(|pressure| pressure.coherent *= 1.0 + LOUDER);
        let moved = self.residuals(numbers, &louder).scaled;
        let pressures = pressures.iter().flatten().flatten();
        moved
            .iter()
            .zip(residuals)
            .zip(pressures)
            .map(|((moved, residual), pressure)| {
                let power = pressure.coherent.norm_sqr().max(f64::MIN_POSITIVE);
                pressure.coherent.conj() / power * ((moved - residual) / LOUDER)
            })
            .collect()
    }

    /// Where the departures of single elements stand among the numbers.
    fn random_ranges(&self) -> Vec<Range<usize>> {
        let mut at = Nuisance::COUNT * self.observations.scans.len();
        let mut ranges = Vec::new();
        for (instance, length) in self.instances.iter().zip(&self.lengths) {
            if instance.effect.search() == Search::Random {
                ranges.push(at..at + length);
            }
            at += length;
        }
        ranges
    }

    /// Each element's part of the pressures: by drive over all scans, then element, then visit.
    fn contributions(&self, numbers: &[f64]) -> Vec<Vec<Vec<Complex64>>> {
        let supposed = self.supposed(numbers);
        let nuisance = self.nuisance(numbers);
        let scans = self.observations.scans.iter().zip(&nuisance);
        scans
            .flat_map(|(scan, nuisance)| scan.drives.iter().map(move |drive| (drive, nuisance)))
            .map(|(drive, nuisance)| {
                let otherwise = drive.otherwise.iter().map(|(_, visit)| *visit);
                let visits: Vec<_> = match supposed.minds_the_way() {
                    true => drive.visits.iter().copied().chain(otherwise).collect(),
                    false => drive.visits.clone(),
                };
                supposed.contributions(&drive.believed, &visits, nuisance)
            })
            .collect()
    }
}

/// Whether an effect's parameters are within what is plausible, and what repeats and silence allow.
pub(super) fn is_plausible(
    observations: &Observations,
    context: &Context,
    instance: &Instance,
    values: &[f64],
) -> bool {
    let parameters = instance.effect.parameters();
    if !parameters.iter().zip(values).all(|(p, v)| (p.least..=p.most).contains(v)) {
        return false;
    }
    let mut supposed = Supposed::default();
    if instance.effect.search() != Search::Random {
        instance.effect.suppose(values, &instance.choice, context, &mut supposed);
    }
    observations.scans.iter().all(|scan| {
        supposed.turbulence <= scan.scatter.most_turbulence
            && supposed.floor <= scan.scatter.most_floor
    })
}

/// The pressures after one element's amplitude and phase changed: the sum is linear in the elements.
fn turned(
    base: &Pressures,
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    before: &Supposed,
    after: &Supposed,
) -> Pressures {
    let change = change_of_weight(element, before, after);
    let mut turned = base.clone();
    let drives = turned.iter_mut().flat_map(|scan| scan.iter_mut());
    for (drive, parts) in drives.zip(contributions) {
        for (pressure, part) in drive.iter_mut().zip(&parts[element]) {
            pressure.coherent += change * part;
        }
    }
    turned
}

/// Relative change of an element's complex amplitude.
fn change_of_weight(element: usize, before: &Supposed, after: &Supposed) -> Complex64 {
    let weight = |supposed: &Supposed| {
        let gain = supposed.gains.get(element).copied().unwrap_or(1.0);
        let phase_rad = supposed.extra_phases_rad.get(element).copied().unwrap_or(0.0);
        Complex64::from_polar(1.0, phase_rad) * gain
    };
    weight(after) / weight(before) - 1.0
}

/// How the residuals change as one element's amplitude does.
fn along_element(
    slopes: &[Complex64],
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    change: Complex64,
) -> Vec<f64> {
    let parts = contributions.iter().flat_map(|drive| &drive[element]);
    slopes.iter().zip(parts).map(|(slope, part)| (slope * part * change).re).collect()
}

/// Fits a set of effects from a start.
pub(super) fn fit(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
) -> Fit {
    let Start { instances, values, spreads, nuisance } = start;
    let nuisance = nuisance
        .unwrap_or_else(|| first_gain(observations, &suppose(&instances, &values, context)));
    let unknowns = unknowns(&instances, &values, &spreads, &nuisance);
    let problem = Problem::new(observations, context, &instances, &values);
    let mut kept = None;
    let mut age = 0;
    let Minimum { parameters, cost: penalised, covariance, .. } = minimise(
        &unknowns,
        stopping,
        |numbers| problem.at(numbers),
        |numbers| {
            if age % KEPT == 0 {
                kept = None;
            }
            age += 1;
            problem.linearise(numbers, &unknowns, &mut kept)
        },
    );
    let residuals = problem.residuals(&parameters, &problem.pressures(&parameters));
    let constant =
        residuals.for_least_squares().iter().map(|r| r * r).sum::<f64>() - residuals.cost();
    let nuisance = problem.nuisance(&parameters);
    let mut rest = parameters[Nuisance::COUNT * nuisance.len()..].to_vec();
    let values = problem.lengths.iter().map(|&length| rest.drain(..length).collect()).collect();
    Fit {
        cost: residuals.cost(),
        penalised: penalised - constant,
        instances,
        values,
        spreads,
        nuisance,
        covariance,
    }
}

fn unknowns(
    instances: &[Instance],
    values: &[Vec<f64>],
    spreads: &[f64],
    nuisance: &[Nuisance],
) -> Vec<Unknown> {
    let mut unknowns = Vec::new();
    for nuisance in nuisance {
        unknowns.push(Unknown { start: nuisance.log_gain, scale: GAIN_SCALE, prior: None });
        let prior = Some((0.0, SHIFT_M));
        let shifts = nuisance.shift_m.iter().map(|&start| (start, SHIFT_SCALE_M));
        unknowns.extend(shifts.map(|(start, scale)| Unknown { start, scale, prior }));
        let (start, prior) = (nuisance.near_field, Some(NEAR_FIELD));
        unknowns.push(Unknown { start, scale: NEAR_FIELD_SCALE, prior });
    }
    for ((instance, values), spread) in instances.iter().zip(values).zip(spreads) {
        if instance.effect.search() == Search::Random {
            let prior = Some((0.0, *spread));
            unknowns.extend(values.iter().map(|&start| Unknown { start, scale: 0.01, prior }));
        } else {
            let parameters = instance.effect.parameters();
            unknowns.extend(values.iter().zip(parameters).map(|(v, p)| unknown(*v, p)));
        }
    }
    unknowns
}

/// What the readings say, to first order, about effects that are not yet in a fit.
pub(super) struct Promises<'o> {
    pub observations: &'o Observations,
    pub context: &'o Context,
    fit: &'o Fit,
    numbers: Vec<f64>,
    unknowns: Vec<Unknown>,
    linear: Linearisation,
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
        Self { observations, context, fit, numbers, unknowns, linear }
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
        let pressures = problem.pressures(&numbers);
        let range = self.numbers.len()..numbers.len();
        problem.columns(&numbers, &unknowns, range, &pressures, &self.linear.residuals)
    }

    /// What an effect promises that begins with these values, at which it must do nothing yet.
    pub fn of_effect(&self, effect: &'static dyn Effect, values: &[f64]) -> Promise {
        let known = self.numbers.len();
        let residuals = &self.linear.residuals;
        let columns = self.columns_of(effect, values);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
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

fn unknown(start: f64, parameter: &Parameter) -> Unknown {
    // The plausible range as a very wide prior: it only keeps apart what the data do not.
    let wide = parameter.most - parameter.least;
    Unknown { start, scale: parameter.scale, prior: Some((parameter.neutral, wide)) }
}

/// When the search for a set of effects stops: a hundredth of a standard deviation is nothing to what is left open.
pub(super) const SEARCH: Stopping =
    levenberg_marquardt::Stopping { iterations: 12, step: 2e-2, fall: 1e-6 };

/// The cost of a fit on other readings.
pub(super) fn cost_on(observations: &Observations, fit: &Fit, context: &Context) -> f64 {
    let supposed = fit.supposed(context);
    let pressures = pressures(observations, &supposed, &fit.nuisance);
    supposed.residuals(observations, &pressures, &fit.nuisance).cost()
}

/// The same set on other readings, from where a fit ended.
pub(super) fn refined(
    fit: Fit,
    observations: &Observations,
    context: &Context,
    stopping: Stopping,
) -> Fit {
    let Fit { instances, values, spreads, nuisance, .. } = fit;
    let start = Start { instances, values, spreads, nuisance: Some(nuisance) };
    fit_any(observations, context, start, stopping)
}

/// Fits a set, finding the spread of elements where one is random.
pub(super) fn fit_any(
    observations: &Observations,
    context: &Context,
    start: Start,
    stopping: Stopping,
) -> Fit {
    let random =
        start.instances.iter().rposition(|instance| instance.effect.search() == Search::Random);
    match random {
        Some(number) => fit_with_spread(observations, context, start, number, stopping),
        None => fit(observations, context, start, stopping),
    }
}
