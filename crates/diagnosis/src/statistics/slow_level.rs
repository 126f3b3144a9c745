//! Slow noise of the level, taken out of residuals and of their derivatives.
//!
//! The gain of receivers and amplifiers wanders with a spectrum of 1/f (flicker noise: R. F. Voss and J. Clarke, Phys. Rev. B 13, 556, 1976). A sum of
//! relaxations, each a factor of four slower than the one before and of the same variance, has that spectrum over their range (A. van der Ziel, Physica 16,
//! 359, 1950). A Kalman filter follows their sum from reading to reading. What it did not predict of a reading, over its standard deviation, has variance one and is
//! independent of the others, so that its sum of squares is that of generalised least squares (A. C. Harvey, *Forecasting, Structural Time Series Models and the
//! Kalman Filter*, 1989, section 3.4). The filter is linear: derivatives pass through it as residuals do.
//!
//! How a residual follows the level is taken from an earlier fit, so that no set of effects changes the filter, unless it changes the scatter. (From the reading
//! itself, whose own noise would then follow the level, a fit to many readings gains by a model of less gain.)

/// Relaxations at most: more than four decades.
const MOST: usize = 8;

/// Factor between their time constants.
const APART: f64 = 4.0;

/// Readings in the shortest time constant at least: faster noise is that of each reading.
const SHORTEST: f64 = 2.0;

/// Slow noise of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlowNoise {
    /// Its standard deviation, relative to the level.
    pub share: f64,
    /// How many relaxations, from the time of the whole scan down, 1 to [`MOST`].
    pub relaxations: usize,
}

impl SlowNoise {
    /// Of a scan with so many readings; `None` if these are too few.
    pub fn of(share: f64, readings: usize) -> Option<Self> {
        let faster = (readings as f64 / SHORTEST).log(APART).floor();
        (faster >= 0.0).then(|| Self { share, relaxations: (faster as usize + 1).min(MOST) })
    }

    /// Time constants in units of the scan's time.
    fn constants(self) -> impl Iterator<Item = f64> {
        (0..self.relaxations).map(|n| APART.powi(-(n as i32)))
    }
}

/// A reading as the filter sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Followed {
    /// Its number among the readings.
    pub reading: usize,
    /// Share of the scan's time that has passed.
    pub progress: f64,
    /// Change of its residual by the logarithm of the level.
    pub slope: f64,
    /// Variance of its residual by the noise of this reading alone.
    pub variance: f64,
}

/// The filter along the readings of a scan.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SlowLevel {
    noise: SlowNoise,
    /// In the order of time.
    steps: Vec<Step>,
}

/// What one reading does to the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    followed: Followed,
    /// What is left of each relaxation since the reading before.
    left: [f64; MOST],
    /// What each relaxation follows of a residual.
    gains: [f64; MOST],
    /// Variance of what is not predicted.
    variance: f64,
}

impl SlowLevel {
    /// Along these readings, in any order.
    pub fn along(noise: SlowNoise, mut readings: Vec<Followed>) -> Self {
        readings.sort_by(|a, b| a.progress.total_cmp(&b.progress));
        let count = noise.relaxations;
        let of_each = noise.share * noise.share / count as f64;
        let mut covariance = [[0.0; MOST]; MOST];
        (0..count).for_each(|n| covariance[n][n] = of_each);
        let mut before = readings.first().map_or(0.0, |first| first.progress);
        let mut decays = ([0.0; MOST], f64::NAN);
        let follow = |followed: Followed| {
            let Followed { progress, slope, variance, .. } = followed;
            let after = progress - before;
            before = progress;
            if after != decays.1 {
                decays.1 = after;
                noise
                    .constants()
                    .zip(&mut decays.0)
                    .for_each(|(t, left)| *left = (-after / t).exp());
            }
            let left = decays.0;
            for (i, row) in covariance.iter_mut().enumerate().take(count) {
                for (entry, by) in row.iter_mut().zip(left).take(count) {
                    *entry *= left[i] * by;
                }
                row[i] += of_each * (1.0 - left[i] * left[i]);
            }
            let across = covariance.map(|row| row.iter().sum::<f64>());
            let level = across.iter().sum::<f64>();
            let all = variance + slope * slope * level;
            let gains = across.map(|across| slope * across / all);
            for (row, gain) in covariance.iter_mut().zip(gains).take(count) {
                for (entry, across) in row.iter_mut().zip(across).take(count) {
                    *entry -= gain * slope * across;
                }
            }
            Step { followed, left, gains, variance: all }
        };
        let steps = readings.into_iter().map(follow).collect();
        Self { noise, steps }
    }

    /// The same beside a scatter of each reading that is larger by a factor: residuals are divided by its root.
    pub fn beside(&self, variance_ratios: &[f64]) -> Self {
        let followed = self.steps.iter().map(|step| {
            let slope = step.followed.slope / variance_ratios[step.followed.reading].sqrt();
            Followed { slope, ..step.followed }
        });
        Self::along(self.noise, followed.collect())
    }

    /// Takes the slow noise out of residuals, or of derivatives of them: what it did not predict, in standard deviations.
    pub fn take_out(&self, residuals: &mut [f64]) {
        let mut state = [0.0; MOST];
        for Step { followed, left, gains, variance } in &self.steps {
            state.iter_mut().zip(left).for_each(|(level, left)| *level *= left);
            let residual = &mut residuals[followed.reading];
            let beyond = *residual - followed.slope * state.iter().sum::<f64>();
            state.iter_mut().zip(gains).for_each(|(level, gain)| *level += gain * beyond);
            *residual = beyond / variance.sqrt();
        }
    }

    /// The strongest step of the level in residuals that the slow noise is taken out of: in their standard deviations, and after which share of the scan's time.
    ///
    /// Each moment is asked by the readings that follow it at once: later ones say less and less, since the level wanders by itself.
    pub fn strongest_step(&self, residuals: &[f64]) -> Option<(f64, f64)> {
        /// Readings after a moment that are asked.
        const AFTER: usize = 100;
        let at = |(first, begin): (usize, &Step)| {
            let mut state = [0.0; MOST];
            let (mut product, mut norm) = (0.0, 0.0);
            for Step { followed, left, gains, variance } in self.steps[first..].iter().take(AFTER) {
                state.iter_mut().zip(left).for_each(|(level, left)| *level *= left);
                let beyond = followed.slope * (1.0 - state.iter().sum::<f64>());
                state.iter_mut().zip(gains).for_each(|(level, gain)| *level += gain * beyond);
                let stepped = beyond / variance.sqrt();
                product += stepped * residuals[followed.reading];
                norm += stepped * stepped;
            }
            (product.abs() / norm.sqrt().max(f64::MIN_POSITIVE), begin.followed.progress)
        };
        let steps = self.steps.iter().enumerate().map(at);
        steps.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Number of each reading, and the variance of what is not predicted of it.
    pub fn variances(&self) -> impl Iterator<Item = (usize, f64)> {
        self.steps.iter().map(|step| (step.followed.reading, step.variance))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    const COUNT: usize = 60;

    fn readings() -> Vec<Followed> {
        let of = |n: usize| {
            let x = n as f64;
            Followed {
                reading: n,
                progress: (x / (COUNT - 1) as f64).powf(1.3),
                slope: 40.0 + 20.0 * (0.7 * x).cos(),
                variance: 1.0 + 0.5 * (0.3 * x).sin(),
            }
        };
        // The order in which they are given does not matter.
        (0..COUNT).rev().map(of).collect()
    }

    /// Against the covariance of all readings inverted as a whole: Σ s²/K exp(-|t - t'|/τ) of the level.
    #[test]
    fn the_sum_of_squares_is_that_of_generalised_least_squares() {
        let noise = SlowNoise::of(0.02, COUNT).expect("enough");
        assert_eq!(noise.relaxations, 3);
        let mut of_each = readings();
        let filter = SlowLevel::along(noise, of_each.clone());
        of_each.reverse();
        let covariance = DMatrix::from_fn(COUNT, COUNT, |i, j| {
            let apart = (of_each[i].progress - of_each[j].progress).abs();
            let level: f64 = noise.constants().map(|t| (-apart / t).exp()).sum();
            let level = noise.share.powi(2) / 3.0 * level;
            of_each[i].slope * of_each[j].slope * level
                + if i == j { of_each[i].variance } else { 0.0 }
        });
        let inverse = covariance.cholesky().expect("positive definite");
        let column = |phase: f64| DVector::from_fn(COUNT, |n, _| (phase + 0.9 * n as f64).sin());
        let [one, other] = [column(0.3), column(1.1)];
        let expected = one.dot(&inverse.solve(&other));
        let [one, other] = [one, other].map(|column| {
            let mut column = column.as_slice().to_vec();
            filter.take_out(&mut column);
            column
        });
        let found: f64 = one.iter().zip(&other).map(|(a, b)| a * b).sum();
        assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} {expected}");
        let logs: f64 = filter.variances().map(|(_, variance)| variance.ln()).sum();
        assert!((logs - inverse.ln_determinant()).abs() < 1e-9, "{logs}");
    }

    #[test]
    fn a_larger_scatter_of_readings_hides_slow_noise() {
        let noise = SlowNoise::of(0.02, COUNT).expect("enough");
        let filter = SlowLevel::along(noise, readings());
        let beside = filter.beside(&[1e12; COUNT]);
        assert!(
            filter
                .variances()
                .all(|(n, variance)| variance > 1.05 * readings()[COUNT - 1 - n].variance)
        );
        let mut residuals = vec![1.0; COUNT];
        beside.take_out(&mut residuals);
        for Followed { reading, variance, .. } in readings() {
            assert!((residuals[reading] - variance.sqrt().recip()).abs() < 1e-6);
        }
    }

    /// A level that is two percent higher from the thirtieth reading on, in residuals without noise, and no step.
    #[test]
    fn a_step_of_the_level_is_found_where_it_is() {
        let filter = SlowLevel::along(SlowNoise::of(0.005, COUNT).expect("enough"), readings());
        let mut residuals = vec![0.0; COUNT];
        let stepped = readings().into_iter().filter(|followed| followed.reading >= 30);
        stepped.for_each(|followed| residuals[followed.reading] = 0.02 * followed.slope);
        filter.take_out(&mut residuals);
        let (step, after) = filter.strongest_step(&residuals).expect("readings");
        let there = (30.0f64 / (COUNT - 1) as f64).powf(1.3);
        assert!(step > 2.0 && (after - there).abs() < 1e-9, "{step} {after} {there}");
        let alternating: Vec<f64> =
            (0..COUNT).map(|n| if n % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let (none, _) = filter.strongest_step(&alternating).expect("readings");
        assert!(none < 2.0, "{none}");
    }

    #[test]
    fn two_readings_have_slow_noise_and_one_has_none() {
        let relaxations = |readings| SlowNoise::of(0.01, readings).map(|noise| noise.relaxations);
        assert_eq!(
            [1, 2, 8, 500, 25_000].map(relaxations),
            [None, Some(1), Some(2), Some(4), Some(7)]
        );
    }
}
