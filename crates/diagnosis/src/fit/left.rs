//! What a fit leaves, level by level, and how likely that is beside a noise that is not known exactly.
//!
//! A fit weighs the readings by one noise, which repeats, dark readings or the fine structure of a residual tell to some percent at best, and few of
//! them hardly at all. A set of effects may not be preferred because it makes up for the error of that estimate. Its likelihood is therefore
//! integrated over both parts of the noise, s in proportion and a in quadrature, by Laplace's method in their logarithms (the integral over one
//! scale gives Student's t: A. Gelman et al., *Bayesian Data Analysis*, 2013, section 3.2). What the fitted numbers take up counts: of n readings
//! and γ numbers that they determine n - γ tell the noise (D. J. C. MacKay, Neural Computation 4, 415, 1992).

use fieldgap_comparison::{DarkReadings, USUAL_PROPORTIONAL_NOISE};
use nalgebra::{Matrix2, Vector2};

use crate::limits::{NOISE_SEARCH_FACTOR, USUAL_ADDITIVE_NOISE, USUAL_NOISE_WITHIN};
use crate::model::effect::Expected;
use crate::model::observations::{Observations, ObservedScan};
use crate::model::phases::PhaseResiduals;
use crate::model::residuals::Residuals;
use crate::statistics::noise_scale::{LEAST_SHARE, lost_with_mean};
use crate::statistics::scatter::against_unusual;

/// Width of a cell of levels, as a logarithm.
const CELL: f64 = 0.15;

/// Levels are told apart down to this share of the quadratures' noise.
const LOWEST: f64 = 0.2;

/// Iterations towards the likeliest noise, and steps of their difference quotients.
const ROUNDS: usize = 20;
const STEP: f64 = 0.02;

/// Readings of about one level.
#[derive(Debug, Clone, Copy)]
struct Cell {
    level: f64,
    count: f64,
    /// Sum of their squared residuals, in variances of the noise that weighed them.
    squares: f64,
}

/// What a fit leaves.
#[derive(Debug, Clone)]
pub(crate) struct Left {
    /// Cells of each scan.
    scans: Vec<Vec<Cell>>,
    /// How many phases of each scan say something, and the sum of their squared residuals.
    phases: Vec<(f64, f64)>,
    /// Sum of the logarithms of the variances that the effects themselves make, over the scan's.
    log_variances: f64,
    /// How many numbers the readings determine.
    freedom: f64,
}

/// How likely what is left is beside an unknown noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Likelihood {
    /// Its natural logarithm; -½ of the cost where the noise is as it was taken to be and known exactly.
    pub log: f64,
    /// The likeliest variance of a reading, over that which weighed it.
    pub variance_ratio: f64,
}

impl Left {
    /// Of residuals, with the expected readings in the same order.
    pub fn of(
        observations: &Observations,
        residuals: &Residuals,
        expected: &[Expected],
        freedom: f64,
    ) -> Self {
        let mut rest = residuals.scaled.iter().zip(expected);
        let cells = |scan: &ObservedScan| {
            let lowest = (LOWEST * scan.scatter.additive).max(f64::MIN_POSITIVE);
            let mut cells: Vec<Cell> = Vec::new();
            for (residual, expected) in rest.by_ref().take(scan.len()) {
                let above = expected.reading.max(lowest).ln() - lowest.ln();
                let number = (above / CELL) as usize;
                if cells.len() <= number {
                    cells.resize(number + 1, Cell { level: 0.0, count: 0.0, squares: 0.0 });
                }
                let cell = &mut cells[number];
                cell.level += expected.reading;
                cell.count += 1.0;
                cell.squares += residual * residual;
            }
            cells.retain(|cell| cell.count > 0.0);
            cells.iter_mut().for_each(|cell| cell.level /= cell.count);
            cells
        };
        let scans = observations.scans.iter().map(cells).collect();
        let of_phases = |phases: &Option<PhaseResiduals>| {
            phases.as_ref().map_or((0.0, 0.0), |phases| {
                (phases.told() as f64, phases.scaled.iter().map(|r| r * r).sum())
            })
        };
        let phases = residuals.phases_of_scans.iter().map(of_phases).collect();
        Self { scans, phases, log_variances: residuals.log_variances.iter().sum(), freedom }
    }

    /// How likely it is.
    pub fn likelihood(&self, observations: &Observations) -> Likelihood {
        let count: f64 = self.scans.iter().flatten().map(|cell| cell.count).sum();
        let phases: f64 = self.phases.iter().map(|(count, _)| count).sum();
        let count = count + phases;
        let told = (1.0 - self.freedom / count).max(1.0 / count);
        let mut all = Likelihood { log: -0.5 * self.log_variances, variance_ratio: 0.0 };
        for (cells, scan) in self.scans.iter().zip(&observations.scans) {
            let noise = UnknownNoise::of(cells, scan, told);
            let Likelihood { log, variance_ratio } = noise.likelihood();
            let share = cells.iter().map(|cell| cell.count).sum::<f64>() / (count - phases);
            all.log += log;
            all.variance_ratio += share * variance_ratio;
        }
        for (&(count, squares), scan) in self.phases.iter().zip(&observations.scans) {
            let within = scan.phase.map_or(1.0, |phase| phase.noise.within);
            all.log += log_of_phases(told * count, squares, within);
        }
        all
    }
}

/// Logarithm of the likelihood of phases with so many residuals and this sum of their squares, less a constant, integrated over their noise:
/// its logarithm u is normal about zero within so much.
fn log_of_phases(count: f64, squares: f64, within: f64) -> f64 {
    if count <= 0.0 {
        return 0.0;
    }
    let tightness = (within * within).recip();
    // What exceeds the estimate by far is a gap, and no noise.
    let most = NOISE_SEARCH_FACTOR.get().ln();
    let mut at = 0.0f64;
    for _ in 0..ROUNDS {
        let left = squares * (-2.0 * at).exp();
        let slope = left - count - tightness * at;
        at = (at + (slope / (2.0 * left + tightness)).clamp(-1.0, 1.0)).clamp(-most, most);
    }
    let left = squares * (-2.0 * at).exp();
    let width = (2.0 * left + tightness) / tightness;
    -count * at - 0.5 * left - 0.5 * tightness * at * at - 0.5 * width.ln()
}

/// The noise of one scan, as logarithms of its share and its additive part.
struct UnknownNoise<'s> {
    scan: &'s ObservedScan,
    dark: Option<DarkReadings>,
    usual_additive: f64,
    /// Level, count, count that tells the noise, squares, and the variance that weighed them.
    cells: Vec<(f64, f64, f64, f64)>,
}

impl<'s> UnknownNoise<'s> {
    fn of(cells: &[Cell], scan: &'s ObservedScan, told: f64) -> Self {
        let largest = scan.drives.iter().flat_map(|d| &d.readings).fold(0.0f64, |a, r| a.max(*r));
        let cells = cells.iter().map(|&Cell { level, count, squares }| {
            (level, told * count, squares, scan.scale.deviation(level).powi(2))
        });
        Self {
            scan,
            dark: scan.dark_readings(),
            usual_additive: (USUAL_ADDITIVE_NOISE.get() * largest).max(f64::MIN_POSITIVE),
            cells: cells.collect(),
        }
    }

    /// Variance of a reading of a level.
    fn variance(&self, share: f64, additive: f64, level: f64) -> f64 {
        let single = additive * self.scan.averaged.sqrt();
        let quadrature = additive * additive * (1.0 - lost_with_mean(level / single));
        share * share * level * level + quadrature
    }

    /// Logarithm of likelihood times prior, less a constant.
    fn log(&self, at: Vector2<f64>) -> f64 {
        let [share, additive] = [at[0].exp(), at[1].exp()];
        let of_readings = |&(level, count, squares, weighed): &(f64, f64, f64, f64)| {
            let ratio = self.variance(share, additive, level) / weighed;
            0.5 * (count * ratio.ln() + squares / ratio)
        };
        let of_silence = match &self.dark {
            None => against_unusual(additive, self.usual_additive),
            Some(dark) if self.scan.scatter.floor > 0.0 => {
                dark.cost(additive, self.scan.scatter.share_in_silence(share))
            }
            Some(dark) => dark.cost_without_floor(additive),
        };
        -self.cells.iter().map(of_readings).sum::<f64>()
            - against_unusual(share, USUAL_PROPORTIONAL_NOISE)
            - of_silence
    }

    /// Slope and curvature of that.
    fn slopes(&self, at: Vector2<f64>, here: f64) -> (Vector2<f64>, Matrix2<f64>) {
        let beside = |x: f64, y: f64| self.log(at + Vector2::new(x, y) * STEP);
        let [right, left, up, down] =
            [beside(1.0, 0.0), beside(-1.0, 0.0), beside(0.0, 1.0), beside(0.0, -1.0)];
        let across = beside(1.0, 1.0) - right - up + here;
        let curvature =
            Matrix2::new(right + left - 2.0 * here, across, across, up + down - 2.0 * here)
                / (STEP * STEP);
        (Vector2::new(right - left, up - down) / (2.0 * STEP), curvature)
    }

    fn likelihood(&self) -> Likelihood {
        let scatter = &self.scan.scatter;
        let additive = scatter.additive.max(1e-3 * self.usual_additive);
        let mut at = Vector2::new(scatter.share.max(LEAST_SHARE).ln(), additive.ln());
        // What exceeds the estimate by far is a gap, and no noise.
        let within = Vector2::repeat(NOISE_SEARCH_FACTOR.get().ln());
        let (least, most) = (at - within, at + within);
        let inside = |at: Vector2<f64>| at.sup(&least).inf(&most);
        let mut here = self.log(at);
        let mut width = Matrix2::identity();
        for _ in 0..ROUNDS {
            let (mut slope, mut curvature) = self.slopes(at, here);
            for part in 0..2 {
                // At an edge that it would cross, one part of the noise stays, and the other is looked for by itself.
                let outwards = if slope[part] > 0.0 { most } else { least };
                if at[part] == outwards[part] {
                    slope[part] = 0.0;
                    curvature.row_mut(part).fill(0.0);
                    curvature.column_mut(part).fill(0.0);
                    curvature[(part, part)] = -USUAL_NOISE_WITHIN.get().powi(-2);
                }
            }
            width = -curvature;
            // Where it is not curved downwards, along the slope.
            let step = match width.cholesky() {
                Some(cholesky) => cholesky.solve(&slope),
                None => slope.component_div(&curvature.diagonal().map(|c| c.abs().max(1.0))),
            };
            let mut step = step / step.amax().max(1.0);
            let mut there = self.log(inside(at + step));
            while there < here && step.amax() > 1e-3 {
                step *= 0.5;
                there = self.log(inside(at + step));
            }
            if there < here {
                break;
            }
            let gained = there - here;
            (at, here) = (inside(at + step), there);
            if gained < 1e-4 {
                break;
            }
        }
        let [share, additive] = [at[0].exp(), at[1].exp()];
        let (mut sum, mut count) = (0.0, 0.0);
        for &(level, told, _, weighed) in &self.cells {
            sum += told * self.variance(share, additive, level) / weighed;
            count += told;
        }
        // At the edge of what an estimate may be off by, the likelihood may be curved upwards. Nowhere is it wider than the prior of a noise.
        let least = USUAL_NOISE_WITHIN.get().powi(-2);
        let volume: f64 = width.symmetric_eigenvalues().iter().map(|c| c.max(least)).product();
        Likelihood { log: here - 0.5 * volume.ln(), variance_ratio: sum / count }
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Excitation, Vec3};

    use super::*;
    use crate::effects::testing::Bench;
    use crate::statistics::scatter::Scatter;

    /// Far from the readings the noise is at the edge of what its estimate may be off by, where the likelihood may be curved upwards.
    #[test]
    fn the_more_a_fit_leaves_the_less_likely_it_is() {
        let bench = Bench::new();
        let places = (0..60).map(|n| Vec3::new(1e-3 * f64::from(n), 0.0, 0.1)).collect();
        let mut observations = bench.observations(&[(Excitation::Uniform, places)]);
        observations.scans[0].set_scatter(Scatter {
            share: 0.02,
            additive: 0.013,
            ..Scatter::default()
        });
        let log = |squares: f64| {
            let cell = |n: u32| Cell {
                level: 0.05 * 1.2f64.powi(n as i32),
                count: 20.0,
                squares: 20.0 * squares,
            };
            let left = Left {
                scans: vec![(0..15).map(cell).collect()],
                phases: vec![(0.0, 0.0)],
                log_variances: 0.0,
                freedom: 5.0,
            };
            left.likelihood(&observations).log
        };
        let logs: Vec<f64> = [1.0, 3.0, 6.0, 10.0, 15.0, 20.0, 40.0, 80.0].map(log).to_vec();
        assert!(logs.is_sorted_by(|one, next| one > next), "{logs:?}");
    }

    /// The integral by the rectangle rule.
    #[test]
    fn phases_are_as_likely_as_the_integral_over_their_noise_says() {
        for (count, squares, within) in
            [(200.0, 230.0, 0.3), (40.0, 25.0, 1.0), (900.0, 2000.0, 0.2)]
        {
            let log =
                |u: f64| -count * u - 0.5 * squares * (-2.0 * u).exp() - 0.5 * (u / within).powi(2);
            let most = log_of_phases(count, squares, within);
            let step = 1e-4;
            let sum: f64 =
                (-10_000..10_000).map(|n| (log(f64::from(n) * step) - most).exp() * step).sum();
            let integral = most + (sum / (within * std::f64::consts::TAU.sqrt())).ln();
            assert!((most - integral).abs() < 0.05, "{count} {squares}: {most} {integral}");
        }
    }
}
