//! How the reference of phases moves during a scan: what places that were visited twice tell.

use nalgebra::{DMatrix, DVector};

use super::median::median;
use super::phase_noise::FEWEST_REPEATS;

/// The phases of two visits of one point.
#[derive(Clone, Copy)]
pub(crate) struct RepeatedPhase {
    /// That of the later one less that of the earlier one, within half a turn.
    pub difference_rad: f64,
    /// Shares of the scan's time that have passed.
    pub from: f64,
    pub to: f64,
    /// Mean variance of the two by the quadratures' noise, rad².
    pub quadratures: f64,
}

impl RepeatedPhase {
    /// Share of the scan's time between them.
    pub fn apart(&self) -> f64 {
        self.to - self.from
    }

    /// Share of the scan's time that lies between both of these pairs: in it they moved together.
    fn together(&self, other: &Self) -> f64 {
        (self.to.min(other.to) - self.from.max(other.from)).max(0.0)
    }
}

/// The steady drift of the reference, rad, and the standard deviation of its motion beside that, rad, over the whole scan.
///
/// The drift has a normal prior of mean zero and standard deviation `stated_rad`. The motion is the largest that the repeats allow, and at most
/// `stated_rad`. The likelihood is that of all differences together: those of a row that is flown twice move as one.
pub(crate) fn motion_of_repeats(pairs: &[RepeatedPhase], stated_rad: f64) -> (f64, f64) {
    /// Pairs that are looked at: a hundred tell a standard deviation to 7 %.
    const MOST: usize = 100;
    /// Median absolute deviations from which on a difference counts as so large: a few repeats may be worse than normal numbers are.
    const WORST: f64 = 6.0;
    /// Nats below the best that are allowed: one standard deviation. Too little leaves some structure, and too much hides small causes.
    const ALLOWED: f64 = 0.5;
    if pairs.len() < FEWEST_REPEATS || stated_rad == 0.0 {
        return (0.0, stated_rad);
    }
    let some: Vec<RepeatedPhase> =
        pairs.iter().step_by(pairs.len().div_ceil(MOST)).copied().collect();
    let count = some.len();
    let middle_rad = median(some.iter().map(|pair| pair.difference_rad).collect());
    let off = |pair: &RepeatedPhase| (pair.difference_rad - middle_rad).abs();
    let most_rad = WORST * median(some.iter().map(off).collect());
    let near = |pair: &RepeatedPhase| {
        middle_rad + (pair.difference_rad - middle_rad).clamp(-most_rad, most_rad)
    };
    let differences = DVector::from_iterator(count, some.iter().map(near));
    let by_drift = DVector::from_iterator(count, some.iter().map(RepeatedPhase::apart));
    // Log likelihood, and the drift.
    let judged = |moves_rad: f64, noise_rad: f64| -> Option<(f64, f64)> {
        let covariance = DMatrix::from_fn(count, count, |i, j| {
            let of_noise = 2.0 * (noise_rad * noise_rad + some[i].quadratures);
            moves_rad * moves_rad * some[i].together(&some[j])
                + stated_rad * stated_rad * by_drift[i] * by_drift[j]
                + if i == j { of_noise } else { 0.0 }
        });
        let factor = covariance.cholesky()?;
        let weighed = factor.solve(&differences);
        let log = -0.5 * (differences.dot(&weighed) + factor.ln_determinant());
        Some((log, stated_rad * stated_rad * by_drift.dot(&weighed)))
    };
    // Octaves: down to a thirtieth of what is stated, and of the noise from what no robot repeats to a quarter of a radian.
    let octaves =
        |from: f64, factor: f64, most: i32| (0..=most).map(move |n| from * factor.powi(n));
    let likeliest = |moves_rad: f64| -> Option<(f64, f64, f64)> {
        let all = octaves(2e-3, 2.0, 7).filter_map(|noise_rad| judged(moves_rad, noise_rad));
        let (log, drift_rad) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((log, drift_rad, moves_rad))
    };
    let found: Vec<_> = octaves(stated_rad, 0.5, 5).filter_map(likeliest).collect();
    let best = found.iter().map(|found| found.0).fold(f64::NEG_INFINITY, f64::max);
    let allowed = found.into_iter().find(|found| found.0 >= best - ALLOWED);
    allowed.map_or((0.0, stated_rad), |(_, drift_rad, moves_rad)| (drift_rad, moves_rad))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Sixty places in the order of time and again at the end, as many that are flown again at once, and none.
    #[test]
    fn repeats_tell_how_the_reference_drifts_and_how_far_it_moves() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut found = |moves_rad: f64, drift_rad: f64, again: usize| {
            const STEPS: usize = 1000;
            let mut at_rad = vec![0.0];
            let step_rad = moves_rad / (STEPS as f64).sqrt();
            (0..STEPS).for_each(|n| at_rad.push(at_rad[n] + step_rad * normal()));
            let pairs: Vec<RepeatedPhase> = (0..60)
                .map(|n| {
                    let [from, to] = [n * again / 60 + 940 - again, 940 + n];
                    let [start, end] = [from, to].map(|n| n as f64 / STEPS as f64);
                    let noise_rad = 0.02 * std::f64::consts::SQRT_2 * normal();
                    let moved_rad = at_rad[to] - at_rad[from] + drift_rad * (end - start);
                    let difference_rad = moved_rad + noise_rad;
                    RepeatedPhase { difference_rad, from: start, to: end, quadratures: 0.0 }
                })
                .collect();
            motion_of_repeats(&pairs, 0.1)
        };
        let mut mean = |moves_rad: f64, drift_rad: f64, again: usize| {
            let all: Vec<(f64, f64)> =
                (0..20).map(|_| found(moves_rad, drift_rad, again)).collect();
            let mean = |of: fn(&(f64, f64)) -> f64| all.iter().map(of).sum::<f64>() / 20.0;
            (mean(|found| found.0), mean(|found| found.1))
        };
        assert!(mean(0.1, 0.0, 900).1 > 0.07);
        assert!(mean(0.0, 0.0, 900).1 < 0.045);
        let (drift_rad, moves_rad) = mean(0.0, 0.07, 900);
        assert!((drift_rad - 0.07).abs() < 0.02 && moves_rad < 0.045, "{drift_rad} {moves_rad}");
        // What moves in a short time is hardly seen.
        assert!(mean(0.1, 0.0, 60).1 > 0.07);
        assert_eq!(motion_of_repeats(&[], 0.1), (0.0, 0.1));
        assert_eq!(motion_of_repeats(&[], 0.0), (0.0, 0.0));
    }
}
