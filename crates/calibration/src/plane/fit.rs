//! The fit: Levenberg and Marquardt's method on the amplitudes, with noise, spreads and the tie of neighbouring readings found on the way.

use nalgebra::{DMatrix, DVector};

use super::dense::inverse_factor;
use super::model::PlaneModel;
use super::parameters::{Group, Layout};
use super::spread::{Prior, Spread};

/// Damping at the start and the least, relative to the curvature of each parameter.
const DAMPING: [f64; 2] = [1e-3, 1e-7];

/// Damping from which on it is felt in the errors: it narrows those of combinations that the readings hardly tell.
const FELT: f64 = 1e-6;

/// Rejected steps in a row after which there is no better one.
const REJECTED: usize = 8;

/// Rounds of the first stage, with elements alike but for a few percent: it brings pose and lobe into reach.
const ALIKE_ROUNDS: usize = 6;

/// Readings for each number in it.
const SOME_FOR_EACH: usize = 4;

/// Spread of weights in it.
const ALIKE: f64 = 0.03;

/// Rounds of the second stage at most.
const ROUNDS: usize = 18;

/// Rounds of the second stage in which neighbours are held to be tied by nothing but the wavelength. What elements alike leave is tied over
/// wavelengths, and a search that took this for noise would leave the elements alike.
const UNTIED_ROUNDS: usize = 5;

/// Structure of a map of amplitudes reaches down to this part of a wavelength: squares of amplitudes hold twice the wavenumber.
const FINEST: f64 = 0.25;

/// It ends when the widths change by less than this, and the cost by less than `COST`.
const WIDTHS: f64 = 0.03;

/// Relative fall of the cost that is nothing.
const COST: f64 = 3e-4;

/// Least noise, relative to the rms of the readings: no converter is better.
const LEAST_NOISE: f64 = 1e-3;

/// Noise of a reading, in units of their rms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelNoise {
    /// At no level.
    pub additive: f64,
    /// Relative to the level.
    pub relative: f64,
}

impl LevelNoise {
    /// Standard deviation at a level.
    pub fn at(self, level: f64) -> f64 {
        self.additive.hypot(self.relative * level)
    }

    /// The noise that residuals at some levels show, with `share` of the readings left by the parameters: mean squares of the upper and the
    /// lower half of the power.
    fn of(levels: &[f64], residuals: &[f64], share: f64) -> Self {
        let mut powers: Vec<f64> = levels.iter().map(|level| level * level).collect();
        powers.sort_by(f64::total_cmp);
        // The upper quarter of the readings holds most of the power.
        let limit = powers[powers.len() * 3 / 4];
        let mean = |high: bool| {
            let (mut power, mut square, mut count) = (0.0, 0.0, 0.0);
            for (level, r) in levels.iter().zip(residuals) {
                if (level * level > limit) == high {
                    power += level * level;
                    square += r * r / share;
                    count += 1.0;
                }
            }
            (power / f64::max(count, 1.0), square / f64::max(count, 1.0))
        };
        let ((high_power, high), (low_power, low)) = (mean(true), mean(false));
        let slope =
            if high_power > low_power { (high - low) / (high_power - low_power) } else { 0.0 };
        let relative = slope.clamp(0.0, low / low_power.max(f64::MIN_POSITIVE));
        let additive = (low - relative * low_power).max(LEAST_NOISE * LEAST_NOISE);
        Self { additive: additive.sqrt(), relative: relative.sqrt() }
    }
}

/// What explains the readings.
#[derive(Debug, Clone)]
pub struct Fit {
    /// What the parameters are.
    pub layout: Layout,
    /// The parameters.
    pub x: Vec<f64>,
    /// Their prior.
    pub prior: Prior,
    /// Its widths.
    pub spread: Spread,
    /// Inverse factor of half the curvature.
    pub inverse_factor: DMatrix<f64>,
    /// Noise of the readings.
    pub noise: LevelNoise,
    /// Readings that tell as much as one that is independent.
    pub readings_of_one: f64,
    /// Rms of the residuals, relative to the rms of these readings.
    pub residual: f64,
    /// The parameters with elements alike but for a few percent: pose, lobe and floor.
    pub alike: Vec<f64>,
}

/// A search under way.
struct Search<'m, 'a> {
    model: &'m PlaneModel<'a>,
    layout: Layout,
    values: Vec<f64>,
    start: Vec<f64>,
    x: Vec<f64>,
    levels: Vec<f64>,
    noise: LevelNoise,
    readings_of_one: f64,
    damping: f64,
    /// Whether the tie of neighbours is learnt from the residuals.
    is_tied: bool,
}

/// Fits elements and pose from a start.
pub fn fit(model: &PlaneModel<'_>, layout: &Layout, start: &[f64]) -> Option<Fit> {
    let alike = Layout { groups: vec![Group::Gain, Group::Phase], ..layout.clone() };
    let x = layout.moved(start, &alike);
    // Numbers that all share are told by some of the readings.
    let some = model.keep.len() / (SOME_FOR_EACH * alike.len()).max(1);
    let some = model.of(model.keep.iter().copied().step_by(some.max(1)).collect());
    let mut search = Search::new(&some, alike.clone(), x);
    let mut narrow = Spread::first(&alike.groups);
    narrow.widths.iter_mut().for_each(|width| width.width = ALIKE);
    for _ in 0..ALIKE_ROUNDS {
        let prior = narrow.prior(&alike, &search.x, &search.start);
        let (factor, fall) = search.round(&prior)?;
        search.learn(&prior, &factor);
        if fall < COST {
            break;
        }
    }
    let x = alike.moved(&search.x, layout);
    let start = alike.moved(&search.start, layout);
    let mut search = Search { start, ..Search::new(model, layout.clone(), x) };
    let alike = search.x.clone();
    let mut spread = Spread::first(&layout.groups);
    let mut rounds = 0;
    loop {
        let prior = spread.prior(layout, &search.x, &search.start);
        let (factor, fall) = search.round(&prior)?;
        let variances = variances(&factor);
        search.learn(&prior, &factor);
        rounds += 1;
        let change = spread.follow(layout, &search.x, &variances, &prior);
        search.is_tied = rounds >= UNTIED_ROUNDS;
        if rounds == ROUNDS || (rounds > UNTIED_ROUNDS && change < WIDTHS && fall < COST) {
            return Some(search.end(prior, spread, factor, alike));
        }
    }
}

/// Variance of each parameter.
pub fn variances(inverse_factor: &DMatrix<f64>) -> Vec<f64> {
    inverse_factor.column_iter().map(|column| column.norm_squared()).collect()
}

impl<'m, 'a> Search<'m, 'a> {
    fn new(model: &'m PlaneModel<'a>, layout: Layout, x: Vec<f64>) -> Self {
        let (values, levels) = (model.values(), model.levels(&layout, &x));
        let mut search = Self {
            model,
            layout,
            values,
            start: x.clone(),
            x,
            levels,
            noise: LevelNoise { additive: 1.0, relative: 0.0 },
            readings_of_one: 1.0,
            damping: DAMPING[0],
            is_tied: false,
        };
        search.learn_noise(0.0);
        search
    }

    fn residuals(&self) -> Vec<f64> {
        self.levels.iter().zip(&self.values).map(|(level, value)| level - value).collect()
    }

    fn residual(&self) -> f64 {
        let power: f64 = self.values.iter().map(|value| value * value).sum();
        let left: f64 = self.residuals().iter().map(|r| r * r).sum();
        (left / power).sqrt()
    }

    /// Standard deviations by which residuals count: neighbours that tell the same count as one.
    fn sd(&self) -> Vec<f64> {
        let one = self.readings_of_one.sqrt();
        self.levels.iter().map(|&level| self.noise.at(level) * one).collect()
    }

    fn cost(&self, levels: &[f64], sd: &[f64]) -> f64 {
        let terms = levels.iter().zip(&self.values).zip(sd);
        terms.map(|((level, value), sd)| ((level - value) / sd).powi(2)).sum()
    }

    /// One step that lowers the cost. Returns the inverse factor of the curvature and the relative fall; `None` if nothing is determined.
    fn round(&mut self, prior: &Prior) -> Option<(DMatrix<f64>, f64)> {
        let sd = self.sd();
        let mut normal = self.model.normal(&self.layout, &self.x, &sd);
        for (k, precision) in prior.precision.iter().enumerate() {
            normal.curvature[(k, k)] += precision;
            normal.downhill[k] -= precision * (self.x[k] - prior.mean[k]);
        }
        let before = self.cost(&self.levels, &sd) + prior.cost(&self.x);
        for _ in 0..REJECTED {
            let mut damped = normal.curvature.clone();
            for k in 0..self.layout.len() {
                damped[(k, k)] *= 1.0 + self.damping;
            }
            let factor = inverse_factor(&damped)?;
            let step: DVector<f64> = factor.tr_mul(&(&factor * &normal.downhill));
            let trial: Vec<f64> =
                self.x.iter().zip(step.iter()).map(|(x, step)| x + step).collect();
            let levels = self.model.levels(&self.layout, &trial);
            let after = self.cost(&levels, &sd) + prior.cost(&trial);
            if after <= before {
                (self.x, self.levels) = (trial, levels);
                // Errors are those of the curvature without damping.
                let is_damped = self.damping > FELT;
                self.damping = (self.damping / 8.0).max(DAMPING[1]);
                let factor = if is_damped { inverse_factor(&normal.curvature)? } else { factor };
                return Some((factor, 1.0 - after / before));
            }
            self.damping *= 8.0;
        }
        Some((inverse_factor(&normal.curvature)?, 0.0))
    }

    /// Learns noise and tie of the neighbours from what is left.
    fn learn(&mut self, prior: &Prior, factor: &DMatrix<f64>) {
        let variances = variances(factor);
        let terms = variances.iter().zip(&prior.precision);
        self.learn_noise(terms.map(|(variance, precision)| 1.0 - variance * precision).sum());
    }

    fn learn_noise(&mut self, determined: f64) {
        let residuals = self.residuals();
        let count = residuals.len() as f64;
        // Of so many independent readings each number takes one.
        let share = (1.0 - determined * self.readings_of_one / count).max(0.1);
        self.noise = LevelNoise::of(&self.levels, &residuals, share);
        self.readings_of_one = if self.is_tied {
            self.model.grid().readings_of_one(&self.model.keep, &residuals)
        } else {
            let finest_m = FINEST * std::f64::consts::TAU / self.model.wavenumber();
            (finest_m / self.model.grid().step_m).powi(2).max(1.0)
        };
    }

    fn end(self, prior: Prior, spread: Spread, factor: DMatrix<f64>, alike: Vec<f64>) -> Fit {
        let residual = self.residual();
        Fit {
            layout: self.layout,
            x: self.x,
            prior,
            spread,
            inverse_factor: factor,
            noise: self.noise,
            readings_of_one: self.readings_of_one,
            residual,
            alike,
        }
    }
}
