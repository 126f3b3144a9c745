//! Slow noise of the level, from what a fit leaves along the time of a scan.

use fieldgap_acoustics::golden_section::least_positive;
use nalgebra::{Matrix2, Vector2};

use crate::limits::{FEWEST_FOR_SLOW_NOISE, FLUCTUATION_SHOWN, MOST_SLOW_NOISE};
use crate::model::observations::ObservedScan;
use crate::statistics::reading_pairs::Level;
use crate::statistics::scatter::Scatter;
use crate::statistics::slow_level::{Followed, SlowLevel, SlowNoise};

/// Least slow noise that is looked for, relative to the level.
const LEAST: f64 = 5e-4;

/// Slow noise that is tried first: of several sizes one is better than none where any is.
const COARSELY: [f64; 3] = [2e-3, 5e-3, 1.2e-2];

/// Shares of the proportional noise, as it was judged, that may be the noise of each reading: repeats have the slow noise as well.
const OF_EACH_READING: [f64; 6] = [1.0, 0.85, 0.7, 0.55, 0.4, 0.2];

/// The scatter with slow noise of the level, where what a fit leaves prefers it, also to steps of the level. Of a fluctuating field, which scatters each
/// reading by itself, none is looked for.
pub(crate) fn with_slow_noise(
    scan: &ObservedScan,
    levels: &[Vec<Level>],
    scatter: Scatter,
) -> Scatter {
    let Some(none) = SlowNoise::of(0.0, scan.len()) else { return scatter };
    if scatter.fluctuation > 0.0 || scan.len() < FEWEST_FOR_SLOW_NOISE {
        return scatter;
    }
    let left = Left::of(scan, levels, &scatter);
    let steady = left.cost(none, scatter.share);
    let coarsely = |share: f64| {
        let of_each = OF_EACH_READING.iter().step_by(2);
        of_each.map(move |of_each| (SlowNoise { share, ..none }, of_each * scatter.share))
    };
    if !COARSELY
        .into_iter()
        .flat_map(coarsely)
        .any(|(slow, of_each)| left.cost(slow, of_each) < steady)
    {
        return scatter;
    }
    let costs = OF_EACH_READING.map(|of_each| {
        let cost = |share: f64| left.cost(SlowNoise { share, ..none }, of_each * scatter.share);
        let otherwise = cost(0.0).min(left.cost_of_steps(of_each * scatter.share));
        (of_each, otherwise, least_positive(LEAST, MOST_SLOW_NOISE, cost))
    });
    let otherwise = costs.iter().map(|(_, otherwise, _)| *otherwise).fold(f64::INFINITY, f64::min);
    let (of_each, _, (share, cost)) =
        costs.into_iter().min_by(|a, b| a.2.1.total_cmp(&b.2.1)).expect("there are some");
    if otherwise - cost < FLUCTUATION_SHOWN.get() {
        return scatter;
    }
    let slow = Some(SlowNoise { share, ..none });
    Scatter { share: of_each * scatter.share, slow, ..scatter }.with_limits()
}

/// What a fit leaves of each reading.
struct Left {
    /// The proportional noise that weighs it.
    share: f64,
    /// Residuals in standard deviations.
    residuals: Vec<f64>,
    /// Where its variance is one, and the part of it by proportional noise of one.
    readings: Vec<(Followed, f64)>,
}

impl Left {
    fn of(scan: &ObservedScan, levels: &[Vec<Level>], scatter: &Scatter) -> Self {
        let mut residuals = Vec::with_capacity(scan.len());
        let mut readings = Vec::with_capacity(scan.len());
        for (drive, levels) in scan.drives.iter().zip(levels) {
            for ((visit, read), level) in drive.visits.iter().zip(&drive.readings).zip(levels) {
                let variance = (scatter.share * level.reading).powi(2) + scatter.additive.powi(2);
                let deviation = (visit.variance * variance).sqrt();
                let followed = Followed {
                    reading: residuals.len(),
                    progress: visit.progress,
                    slope: level.reading / deviation,
                    variance: 1.0,
                };
                readings.push((followed, level.reading * level.reading / variance));
                residuals.push((read - level.reading) / deviation);
            }
        }
        Self { share: scatter.share, residuals, readings }
    }

    /// The readings with this proportional noise.
    fn beside(&self, share: f64) -> impl Iterator<Item = Followed> {
        let less = self.share * self.share - share * share;
        self.readings.iter().map(move |(followed, by_share)| Followed {
            variance: 1.0 - less * by_share,
            ..*followed
        })
    }

    /// The same as [`Self::cost`] for a level that steps at some moments and drifts steadily between them. (A step is no effect, and a drift in the fit takes up
    /// what it can of one.) Each step costs the logarithm of the number of readings for its moment, and as much for level and drift after it (G. Schwarz, Ann.
    /// Statist. 6, 461, 1978). Moments are found one within another (L. J. Vostrikova, Soviet Math. Dokl. 24, 55, 1981).
    fn cost_of_steps(&self, share: f64) -> f64 {
        let mut readings: Vec<Followed> = self.beside(share).collect();
        readings.sort_by(|a, b| a.progress.total_cmp(&b.progress));
        let mut cost = 0.0;
        let lines: Vec<Line> = readings
            .iter()
            .map(|Followed { reading, slope, variance, progress }| {
                let residual = self.residuals[*reading];
                cost += 0.5 * (residual * residual / variance + variance.ln());
                let by_level = Vector2::new(1.0, *progress) * *slope;
                Line {
                    product: by_level * (residual / variance),
                    power: by_level * by_level.transpose() / *variance,
                }
            })
            .collect();
        let all = lines.iter().copied().fold(Line::default(), Line::and);
        cost - all.saves() - saved_by_steps(&lines, all, 2.0 * (lines.len() as f64).ln())
    }

    /// Negative logarithm of the likelihood, less a constant.
    fn cost(&self, slow: SlowNoise, share: f64) -> f64 {
        let filter = SlowLevel::along(slow, self.beside(share).collect());
        let mut residuals = self.residuals.clone();
        filter.take_out(&mut residuals);
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        0.5 * (squares + filter.variances().map(|(_, variance)| variance.ln()).sum::<f64>())
    }
}

/// Some readings' slope and curvature of half the cost by a level that drifts steadily.
#[derive(Debug, Clone, Copy, Default)]
struct Line {
    product: Vector2<f64>,
    power: Matrix2<f64>,
}

impl Line {
    fn and(self, other: Self) -> Self {
        Self { product: self.product + other.product, power: self.power + other.power }
    }

    fn less(self, other: Self) -> Self {
        Self { product: self.product - other.product, power: self.power - other.power }
    }

    /// By how much such a level lowers the cost, with a level known beforehand to about itself.
    fn saves(self) -> f64 {
        let curvature = self.power + Matrix2::identity();
        curvature
            .try_inverse()
            .map_or(0.0, |inverse| 0.5 * self.product.dot(&(inverse * self.product)))
    }
}

/// By how much steps between these readings lower the cost beyond what each costs, given the sum of all.
fn saved_by_steps(lines: &[Line], all: Line, each: f64) -> f64 {
    let mut before = Line::default();
    let mut best = (0.0, 0, before);
    for (number, line) in lines.iter().enumerate() {
        before = before.and(*line);
        let saved = before.saves() + all.less(before).saves() - all.saves() - each;
        if saved > best.0 {
            best = (saved, number + 1, before);
        }
    }
    let (saved, at, before) = best;
    match saved > 0.0 {
        true => {
            let (first, then) = lines.split_at(at);
            saved
                + saved_by_steps(first, before, each)
                + saved_by_steps(then, all.less(before), each)
        }
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels of residuals of variance one, each with a drift, and one that drifts all along.
    #[test]
    fn steps_lower_the_cost_and_a_drift_alone_does_not() {
        let line = |n: usize, level: f64| {
            let by_level = Vector2::new(1.0, n as f64 / 100.0);
            Line { product: by_level * level, power: by_level * by_level.transpose() }
        };
        let saved = |level: &dyn Fn(usize) -> f64| {
            let lines: Vec<Line> = (0..100).map(|n| line(n, level(n))).collect();
            let all = lines.iter().copied().fold(Line::default(), Line::and);
            saved_by_steps(&lines, all, 2.0 * 100f64.ln())
        };
        let drift = |n: usize| 0.03 * n as f64;
        assert_eq!(saved(&drift), 0.0);
        let one = saved(&|n| drift(n) + if n < 40 { 0.0 } else { 2.0 });
        let two = saved(&|n| drift(n) + if (30..70).contains(&n) { 2.0 } else { 0.0 });
        assert!(one > 5.0 && two > 20.0, "{one} {two}");
    }
}
