//! The noise of phases beyond that of the quadratures: from repeats, else from the fine structure along the order of acquisition.

use std::f64::consts::{PI, TAU};

/// Noise of a phase where nothing tells it, rad. Set by judgement: a lock-in whose clock jitters by 80 ns at 40 kHz.
const USUAL_RAD: f64 = 0.02;

/// Least noise of a phase that is taken for granted, rad: 3 µm of path at 40 kHz, which no robot repeats. Set by judgement.
const LEAST_RAD: f64 = 2e-3;

/// Largest one. Beyond it a phase says next to nothing.
const MOST_RAD: f64 = 1.5;

/// Differences below which they say nothing: eight tell a standard deviation to 25 %; a median needs three times as many, and those of
/// neighbours overlap.
const FEWEST_REPEATS: usize = 8;
const FEWEST_NEIGHBOURS: usize = 50;

/// Median of the square of a normal number, and the information of a median of them about their variance over that of their mean.
const MEDIAN: f64 = 0.455;
const MEDIAN_OVER_MEAN: f64 = 0.37;

/// Share of third differences that are independent: they overlap with a sum of squared correlations of 2.3.
const INDEPENDENT: f64 = 1.0 / 2.3;

/// The logarithm of the noise is not taken to be known better than this: noise is not quite the same at every level. Set by judgement.
const LEAST_WITHIN: f64 = 0.05;

/// Standard deviation of a phase's own noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PhaseNoise {
    /// The standard deviation, rad.
    pub rad: f64,
    /// Standard deviation of its natural logarithm.
    pub within: f64,
}

impl Default for PhaseNoise {
    fn default() -> Self {
        Self { rad: USUAL_RAD, within: 1.0 }
    }
}

/// A difference of phases: its square over the number of variances in it, and the variance that the quadratures' noise makes of it.
pub(crate) type Difference = (f64, f64);

impl PhaseNoise {
    /// Of differences between repeats, and of third differences of what a model leaves between neighbours.
    pub fn of(repeats: Vec<Difference>, neighbours: Vec<Difference>) -> Self {
        let of = |differences: Vec<Difference>, independent: f64| {
            let (rad, used) = likeliest(differences);
            let within = (2.0 * independent * MEDIAN_OVER_MEAN * used as f64).sqrt().recip();
            Self { rad, within: within.max(LEAST_WITHIN) }
        };
        if repeats.len() >= FEWEST_REPEATS {
            return of(repeats, 1.0);
        }
        match neighbours.len() >= FEWEST_NEIGHBOURS {
            true => of(neighbours, INDEPENDENT),
            false => Self::default(),
        }
    }
}

/// A phase within half a turn of zero.
pub(crate) fn wrapped(phase_rad: f64) -> f64 {
    phase_rad - TAU * (phase_rad / TAU).round()
}

/// Third difference of four phases of neighbours that differ by less than half a turn.
pub(crate) fn third_difference(phases_rad: [f64; 4]) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|n| wrapped(phases_rad[n + 1] - phases_rad[n]));
    wrapped(c - 2.0 * b + a)
}

/// Mean square of a third difference over the variance of one phase.
pub(crate) const THIRD: f64 = 20.0;

/// The standard deviation at which the median is that of normal numbers: a gap may be rough in places. Only the third at the highest levels
/// counts, as the quadratures' noise hides that of the phases elsewhere. Second, how many count.
fn likeliest(mut differences: Vec<Difference>) -> (f64, usize) {
    differences.sort_by(|a, b| a.1.total_cmp(&b.1));
    differences.truncate((differences.len() / 3).max(FEWEST_REPEATS));
    let is_wider = |rad: f64| {
        let scaled = differences
            .iter()
            .map(|(square, of_quadratures)| square / (rad * rad + of_quadratures));
        let mut scaled: Vec<f64> = scaled.collect();
        let middle = scaled.len() / 2;
        let (_, median, _) = scaled.select_nth_unstable_by(middle, f64::total_cmp);
        *median > MEDIAN
    };
    let (mut least, mut most) = (LEAST_RAD, MOST_RAD.min(PI));
    while most / least > 1.01 {
        let between = (least * most).sqrt();
        if is_wider(between) { least = between } else { most = between }
    }
    ((least * most).sqrt(), differences.len())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn noise_beyond_the_quadratures_is_found_from_repeats_and_from_neighbours() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let phase = |n: usize, of: f64, noise: f64| {
            wrapped(2.5 * (n as f64 / 90.0).sin() * 9.0 + of.hypot(0.03) * noise)
        };
        let levels: Vec<f64> = (0..12_000).map(|n| 0.005 + 0.02 * f64::from(n % 7)).collect();
        let phases: Vec<f64> =
            levels.iter().enumerate().map(|(n, of)| phase(n, *of, normal())).collect();
        let third = |n: usize| {
            let difference = third_difference([0, 1, 2, 3].map(|k| phases[n + k]));
            let of = (levels[n].powi(2)
                + 9.0 * levels[n + 1].powi(2)
                + 9.0 * levels[n + 2].powi(2)
                + levels[n + 3].powi(2))
                / THIRD;
            (difference * difference / THIRD, of)
        };
        let found = PhaseNoise::of(Vec::new(), (0..11_990).map(third).collect());
        assert!((found.rad / 0.03 - 1.0).abs() < 0.12, "{found:?}");
        let again: Vec<f64> =
            levels.iter().enumerate().map(|(n, of)| phase(n, *of, normal())).collect();
        let pair = |n: usize| (0.5 * wrapped(again[n] - phases[n]).powi(2), levels[n].powi(2));
        let found = PhaseNoise::of((0..6000).map(pair).collect(), Vec::new());
        assert!((found.rad / 0.03 - 1.0).abs() < 0.12, "{found:?}");
        assert_eq!(PhaseNoise::of(Vec::new(), Vec::new()), PhaseNoise::default());
    }
}
