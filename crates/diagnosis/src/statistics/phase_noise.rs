//! The noise of phases beyond that of the quadratures: from repeats, else from the fine structure along the order of acquisition.

use std::f64::consts::{PI, TAU};

/// Noise of a phase where nothing tells it, rad. Set by judgement: a lock-in whose clock jitters by 80 ns at 40 kHz.
const USUAL_RAD: f64 = 0.02;

/// Least noise of a phase that is taken for granted, rad: 3 µm of path at 40 kHz, which no robot repeats. Set by judgement.
const LEAST_RAD: f64 = 2e-3;

/// Largest one. Beyond it a phase says next to nothing.
const MOST_RAD: f64 = 1.5;

/// Differences below which they say nothing: eight tell a standard deviation to 25 %; those of neighbours need a median, and overlap.
pub(crate) const FEWEST_REPEATS: usize = 8;
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
        let of_repeats = (repeats.len() >= FEWEST_REPEATS).then(|| Self::of_repeats(&repeats));
        let of_neighbours = (neighbours.len() >= FEWEST_NEIGHBOURS).then(|| {
            let (rad, used) = likeliest(neighbours);
            let within = (2.0 * INDEPENDENT * MEDIAN_OVER_MEAN * used as f64).sqrt().recip();
            Self { rad, within: within.max(LEAST_WITHIN) }
        });
        match (of_repeats, of_neighbours) {
            (Some(noise), Some(neighbours)) if neighbours.is_larger_than(&repeats) => noise,
            (Some(noise), Some(neighbours)) => noise.and(neighbours),
            (one, other) => one.or(other).unwrap_or_default(),
        }
    }

    /// Whether repeats show less, by more than the errors of both: then a rough gap is in the noise of neighbours.
    fn is_larger_than(self, repeats: &[Difference]) -> bool {
        /// In standard deviations.
        const LARGER: f64 = 2.0;
        let least_rad = self.rad * (-self.within).exp();
        let (mut missing, mut information) = (0.0, 0.0);
        for (square, of_quadratures) in repeats {
            let variance = least_rad * least_rad + of_quadratures;
            missing += (1.0 - square / variance) / variance;
            information += 2.0 / (variance * variance);
        }
        missing > LARGER * information.sqrt()
    }

    /// Both together.
    fn and(self, other: Self) -> Self {
        let [one, another] = [self, other].map(|noise| noise.within.powi(-2));
        let log = (one * self.rad.ln() + another * other.rad.ln()) / (one + another);
        Self { rad: log.exp(), within: (one + another).sqrt().recip().max(LEAST_WITHIN) }
    }

    /// The likeliest noise, each repeat counting by what it tells. Some repeats may be worse than normal numbers are: their squares count up to a limit.
    fn of_repeats(repeats: &[Difference]) -> Self {
        /// In variances: three standard deviations.
        const MOST_SQUARE: f64 = 9.0;
        let rad = halved(|rad| {
            let of = |(square, of_quadratures): &Difference| {
                let variance = rad * rad + of_quadratures;
                ((square / variance).min(MOST_SQUARE) - 1.0) / variance
            };
            repeats.iter().map(of).sum::<f64>() > 0.0
        });
        let told = |(_, of_quadratures): &Difference| {
            let share = rad * rad / (rad * rad + of_quadratures);
            share * share
        };
        let within = (2.0 * repeats.iter().map(told).sum::<f64>()).sqrt().recip();
        Self { rad, within: within.clamp(LEAST_WITHIN, Self::default().within) }
    }
}

/// The noise, rad, from which on it is not wider.
fn halved(is_wider: impl Fn(f64) -> bool) -> f64 {
    let (mut least, mut most) = (LEAST_RAD, MOST_RAD.min(PI));
    while most / least > 1.01 {
        let between = (least * most).sqrt();
        if is_wider(between) { least = between } else { most = between }
    }
    (least * most).sqrt()
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

/// Of neighbours, the standard deviation at which the median is that of normal numbers: a gap may be rough in places. Only the third at the highest levels
/// counts, as the quadratures' noise hides that of the phases elsewhere. Second, how many count.
fn likeliest(mut differences: Vec<Difference>) -> (f64, usize) {
    differences.sort_by(|a, b| a.1.total_cmp(&b.1));
    differences.truncate(differences.len() / 3);
    let is_wider = |rad: f64| {
        let scaled = differences
            .iter()
            .map(|(square, of_quadratures)| square / (rad * rad + of_quadratures));
        let mut scaled: Vec<f64> = scaled.collect();
        let middle = scaled.len() / 2;
        let (_, median, _) = scaled.select_nth_unstable_by(middle, f64::total_cmp);
        *median > MEDIAN
    };
    (halved(is_wider), differences.len())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn neighbours_help_repeats_unless_a_gap_is_rough() {
        let of = |rad: f64, within: f64| PhaseNoise { rad, within };
        let both = of(0.02, 0.4).and(of(0.025, 0.2));
        assert!((both.rad.ln() - (0.2 * 0.02f64.ln() + 0.8 * 0.025f64.ln())).abs() < 1e-12);
        assert!((both.within - 0.4 * 0.2 / 0.4f64.hypot(0.2)).abs() < 1e-12);
        // Sixteen repeats of 0.02 rad: beside 0.06 rad they are clearly too alike, beside 0.022 rad or quadratures of 0.1 rad they are not.
        let repeats = |of_quadratures: f64| vec![(4e-4 + of_quadratures, of_quadratures); 16];
        assert!(of(0.06, 0.1).is_larger_than(&repeats(0.0)));
        assert!(!of(0.022, 0.1).is_larger_than(&repeats(0.0)));
        assert!(!of(0.06, 0.1).is_larger_than(&repeats(1e-2)));
    }

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
