//! The reference of phases, which wanders during a scan, taken out of residuals and of their derivatives.
//!
//! Its constant is not known. It drifts steadily, as a clock that warms up, and moves about that as a Brownian motion. A Kalman filter follows it from
//! reading to reading. What it did not predict of a reading, over its standard deviation, has variance one and is independent of the others; the sum of squares is
//! that of generalised least squares with the covariance of drift and motion (A. C. Harvey, *Forecasting, Structural Time Series Models and the Kalman Filter*, 1989, sections 3.2 and
//! 3.4). The filter is linear in the residuals, so that derivatives pass through it as residuals do.
//!
//! The differences are turned by what the filter predicts (an extended filter), so that a reference may wander by more than a radian.

use num_complex::Complex64;

/// A reading whose phase says something.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// Its number among the readings.
    pub reading: usize,
    /// Measured over expected phase, of size one.
    pub turn: Complex64,
    /// The reading over the standard deviation of its quadrature; above zero.
    pub weight: f64,
    /// Share of the scan's time that has passed.
    pub progress: f64,
}

/// The filter along the readings of one reference.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct WanderingReference {
    /// In the order of time.
    steps: Vec<Step>,
}

/// Motion of a reference from which on it may end far from where it begins, rad.
const FAR_RAD: f64 = 1.0;

/// Readings at least by which such a one is found at first: so many that one that is far off does not count.
const FIRST: usize = 10;

/// What is known of a reference beside its constant: standard deviations over the whole scan, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReferenceMotion {
    /// Of its steady drift.
    pub drift_rad: f64,
    /// Of what it moves beside that.
    pub moves_rad: f64,
}

/// What one reading does to the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    reading: usize,
    /// Share of the scan's time since the reading before.
    after: f64,
    /// Change of the residual by its phase difference.
    slope: f64,
    /// What the reference and its drift follow of a residual.
    gain: f64,
    gain_of_drift: f64,
    /// One over the standard deviation of what is not predicted; zero for the first reading, which nothing predicts.
    weight: f64,
}

impl WanderingReference {
    /// Follows a reference. Gives each reading its residual and its slope to `set`.
    pub fn along(
        mut turns: Vec<Turn>,
        ReferenceMotion { drift_rad, moves_rad }: ReferenceMotion,
        mut set: impl FnMut(usize, f64, f64),
    ) -> Self {
        turns.sort_by(|a, b| a.progress.total_cmp(&b.progress));
        // Where it is before the first reading: anywhere about where it fits all of them best or, if it may turn far, the first of them.
        let about = match drift_rad + moves_rad < FAR_RAD {
            true => turns.len(),
            false => (turns.len() / 10).max(FIRST),
        };
        let about = turns.iter().take(about);
        let sum: Complex64 = about.map(|turn| turn.weight * turn.weight * turn.turn).sum();
        let (mut at_rad, mut drift) = (sum.arg(), 0.0);
        let (mut variance, mut across, mut of_drift) = (f64::INFINITY, 0.0, drift_rad * drift_rad);
        let mut before = turns.first().map_or(0.0, |turn| turn.progress);
        let mut steps = Vec::with_capacity(turns.len());
        for Turn { reading, turn, weight, progress } in turns {
            let after = progress - before;
            before = progress;
            at_rad += after * drift;
            variance += after * (2.0 * across + after * of_drift + moves_rad * moves_rad);
            across += after * of_drift;
            let turn = turn * Complex64::cis(-at_rad);
            let half_cosine = (0.5 * (1.0 + turn.re)).max(0.0).sqrt();
            // The root loses digits where the difference is small.
            let half_sine = match turn.re > 0.0 {
                true => 0.5 * turn.im / half_cosine,
                false => (0.5 * (1.0 - turn.re)).sqrt().copysign(turn.im),
            };
            let (residual, slope) = (2.0 * weight * half_sine, weight * half_cosine);
            let mut step =
                Step { reading, after, slope, gain: 0.0, gain_of_drift: 0.0, weight: 0.0 };
            if variance.is_finite() {
                let all = 1.0 + slope * slope * variance;
                step.gain = variance * slope / all;
                step.gain_of_drift = across * slope / all;
                step.weight = all.sqrt().recip();
                of_drift -= step.gain_of_drift * slope * across;
                variance /= all;
                across /= all;
            } else {
                // One that is off by half a turn has no slope. It is taken to say as much as others of its weight.
                variance = weight.powi(-2);
                step.gain = slope * variance;
            }
            at_rad += step.gain * residual;
            drift += step.gain_of_drift * residual;
            set(reading, step.weight * residual, slope);
            steps.push(step);
        }
        Self { steps }
    }

    /// Takes the reference out of derivatives of the residuals.
    pub fn take_out(&self, derivatives: &mut [f64]) {
        let (mut followed, mut drift) = (0.0, 0.0);
        for &Step { reading, after, slope, gain, gain_of_drift, weight } in &self.steps {
            followed += after * drift;
            let left = derivatives[reading] - slope * followed;
            followed += gain * left;
            drift += gain_of_drift * left;
            derivatives[reading] = weight * left;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    fn turns(count: usize) -> Vec<Turn> {
        (0..count)
            .map(|n| {
                let x = n as f64;
                let rad = 2.5 + 0.06 * (1.3 * x).sin() + 0.002 * x;
                Turn {
                    reading: n,
                    turn: Complex64::cis(rad),
                    weight: 30.0 + 10.0 * (0.7 * x).cos(),
                    progress: x / (count - 1) as f64,
                }
            })
            .collect()
    }

    /// Against the covariance of all readings inverted as a whole: min(s, t) m² of the motion, s t u² of the drift, and a very large one of the constant.
    #[test]
    fn the_sum_of_squares_is_that_of_generalised_least_squares() {
        for (drift_rad, moves_rad) in [(0.0, 0.0), (0.1, 0.0), (0.0, 0.1), (0.5, 0.1), (0.1, 2.0)] {
            let motion = ReferenceMotion { drift_rad, moves_rad };
            let turns = turns(40);
            let (mut scaled, mut slopes) = (vec![0.0; 40], vec![0.0; 40]);
            let reference = WanderingReference::along(turns.clone(), motion, |n, r, slope| {
                scaled[n] = r;
                slopes[n] = slope;
            });
            let covariance = DMatrix::from_fn(40, 40, |i, j| {
                let [s, t] = [i, j].map(|n| turns[n].progress);
                let of_motion = moves_rad * moves_rad * s.min(t);
                let of_reference = of_motion + drift_rad * drift_rad * s * t + 1e4;
                slopes[i] * slopes[j] * of_reference + if i == j { 1.0 } else { 0.0 }
            });
            let inverse = covariance.cholesky().expect("positive definite");
            let column = |phase: f64| DVector::from_fn(40, |n, _| (phase + 0.9 * n as f64).sin());
            let [one, other] = [column(0.3), column(1.1)];
            let expected = one.dot(&inverse.solve(&other));
            let [one, other] = [one, other].map(|column| {
                let mut column = column.as_slice().to_vec();
                reference.take_out(&mut column);
                column
            });
            let found: f64 = one.iter().zip(&other).map(|(a, b)| a * b).sum();
            assert!((found - expected).abs() < 1e-4 * expected.abs(), "{found} {expected}");
            // The differences are small: the residuals are nearly linear in them.
            let mut linear: Vec<f64> =
                (0..40).map(|n| turns[n].weight * (turns[n].turn.arg() - 2.5)).collect();
            reference.take_out(&mut linear);
            let pairs = scaled.iter().zip(&linear);
            let missed: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
            let whole = linear.iter().map(|r| r * r).sum::<f64>().sqrt();
            assert!(missed < 0.02 * whole, "{missed} of {whole}");
        }
    }

    /// A clock that turns by four radians in a scan is followed, the order of the readings notwithstanding.
    #[test]
    fn a_reference_that_turns_far_is_followed() {
        let count = 300;
        let mut turns: Vec<Turn> = (0..count)
            .map(|n| {
                let progress = n as f64 / (count - 1) as f64;
                Turn { reading: n, turn: Complex64::cis(4.0 * progress), weight: 50.0, progress }
            })
            .collect();
        turns.reverse();
        for (drift_rad, moves_rad) in [(4.0, 0.0), (0.1, 4.0)] {
            let motion = ReferenceMotion { drift_rad, moves_rad };
            let mut squares = 0.0;
            WanderingReference::along(turns.clone(), motion, |_, r, _| squares += r * r);
            assert!(squares < 0.1 * count as f64, "{squares}");
        }
    }

    /// Of readings of which one is off by half a turn, the others are not moved.
    #[test]
    fn half_a_turn_leads_nobody_astray() {
        let mut turns = turns(20);
        turns.iter_mut().for_each(|turn| turn.turn = Complex64::cis(1.0));
        turns[7].turn = Complex64::cis(1.0 + std::f64::consts::PI);
        let weight = turns[7].weight;
        let motion = ReferenceMotion { drift_rad: 0.1, moves_rad: 0.1 };
        WanderingReference::along(turns, motion, |n, residual, _| match n {
            7 => assert!((residual.abs() - 2.0 * weight).abs() < 1e-6 * weight),
            _ => assert!(residual.abs() < 1e-6, "{n}: {residual}"),
        });
    }
}
