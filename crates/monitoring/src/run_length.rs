//! Average run lengths of control charts, and limits from them.
//!
//! The average run length (ARL) L(u) of a chart whose statistic is at u solves a Fredholm equation of the second kind: one run,
//! and then what remains from where that run leads. Gauss-Legendre quadrature turns it into a linear system (Nyström's method;
//! Crowder, Technometrics 29, 401, 1987, for the EWMA; Vance, J. Quality Technology 18, 188, 1986, for the CUSUM). It is more
//! accurate than the Markov chain of Brook and Evans (Biometrika 59, 539, 1972), which takes the statistic as constant within
//! each of its states.

use nalgebra::{DMatrix, DVector};

use crate::normal::{below, density};

/// A statistic on independent standard normal scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statistic {
    /// Exponentially weighted moving average of weight λ; its limit is in its own standard deviations, √(λ/(2 - λ)).
    Ewma {
        /// Weight of the newest score, 0 < λ <= 1.
        lambda: f64,
        /// Whether falls count too. If not, the average is kept at zero or above.
        two_sided: bool,
    },
    /// Cumulative sum of what exceeds k; its limit h is in standard deviations of a score.
    Cusum {
        /// Reference value: half of the change for which the chart is best.
        k: f64,
        /// Whether a second sum counts falls.
        two_sided: bool,
    },
}

/// Nodes for each standard deviation of one step, and at least.
const NODES_PER_DEVIATION: f64 = 5.0;
const FEWEST_NODES: f64 = 24.0;

impl Statistic {
    /// Average run length until the statistic first exceeds `limit`, starting at zero, with scores of mean `shift`.
    pub fn average_run_length(self, limit: f64, shift: f64) -> f64 {
        match self {
            Self::Ewma { lambda, two_sided: true } => {
                let h = limit * ewma_deviation(lambda);
                integrated(-h, h, lambda, |u| (1.0 - lambda) * u + lambda * shift, false)
            }
            Self::Ewma { lambda, two_sided: false } => {
                let h = limit * ewma_deviation(lambda);
                integrated(0.0, h, lambda, |u| (1.0 - lambda) * u + lambda * shift, true)
            }
            Self::Cusum { k, two_sided } => {
                let one = |shift: f64| integrated(0.0, limit, 1.0, |u| u + shift - k, true);
                // The two sums are never both above zero when one of them alarms (van Dobben de Bruyn, Cumulative Sum Tests, 1968).
                if two_sided { 1.0 / (1.0 / one(shift) + 1.0 / one(-shift)) } else { one(shift) }
            }
        }
    }

    /// The limit at which the average run length without any change is `runs`.
    pub fn limit_for(self, runs: f64) -> f64 {
        let long_enough = |limit: f64| self.average_run_length(limit, 0.0) >= runs;
        let (mut short, mut long) = (0.0, 2.0);
        while !long_enough(long) {
            short = long;
            long *= 1.5;
        }
        // Each halving decides one more binary digit; the last is a hundred-thousandth of a standard deviation.
        for _ in 0..20 {
            let middle = 0.5 * (short + long);
            if long_enough(middle) {
                long = middle;
            } else {
                short = middle;
            }
        }
        long
    }
}

/// Standard deviation of an EWMA of many standard normal scores.
pub fn ewma_deviation(lambda: f64) -> f64 {
    (lambda / (2.0 - lambda)).sqrt()
}

/// L(0) of L(u) = 1 + ∫ L(y) f(y | u) dy over low..high, where the next statistic is normal about `mean(u)` with `deviation`; with
/// `atom`, all that would fall below `low` stays at `low`.
fn integrated(low: f64, high: f64, deviation: f64, mean: impl Fn(f64) -> f64, atom: bool) -> f64 {
    let nodes = (NODES_PER_DEVIATION * (high - low) / deviation).max(FEWEST_NODES) as usize;
    let (at, weight) = gauss_legendre(nodes, low, high);
    let size = nodes + usize::from(atom);
    // The last row and column are those of the atom.
    let from = |row: usize| mean(if row < nodes { at[row] } else { low });
    let system = DMatrix::from_fn(size, size, |row, column| {
        let reached = if column < nodes {
            weight[column] * density((at[column] - from(row)) / deviation) / deviation
        } else {
            below((low - from(row)) / deviation)
        };
        f64::from(u8::from(row == column)) - reached
    });
    let Some(lengths) = system.lu().solve(&DVector::from_element(size, 1.0)) else {
        return f64::INFINITY;
    };
    let zero = mean(0.0);
    let reached: f64 = (0..nodes)
        .map(|j| weight[j] * density((at[j] - zero) / deviation) / deviation * lengths[j])
        .sum();
    let kept = if atom { below((low - zero) / deviation) * lengths[nodes] } else { 0.0 };
    1.0 + reached + kept
}

/// Nodes and weights of Gauss-Legendre quadrature over low..high: the zeros of the Legendre polynomial by Newton's method.
fn gauss_legendre(count: usize, low: f64, high: f64) -> (Vec<f64>, Vec<f64>) {
    let n = count as f64;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..12 {
            let (mut last, mut value) = (1.0, x);
            for degree in 2..=count {
                let degree = degree as f64;
                let next = ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * last) / degree;
                last = value;
                value = next;
            }
            slope = n * (x * value - last) / (x * x - 1.0);
            x -= value / slope;
        }
        (middle - half * x, 2.0 * half / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).unzip()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::chart::Chart;
    use crate::settings::{ChartKind, Sides};

    fn ewma(lambda: f64) -> Statistic {
        Statistic::Ewma { lambda, two_sided: true }
    }

    fn cusum(k: f64, two_sided: bool) -> Statistic {
        Statistic::Cusum { k, two_sided }
    }

    /// Lucas and Saccucci, Technometrics 32, 1, 1990: average run lengths of two-sided EWMA charts, to the printed digits.
    #[test]
    fn ewma_charts_have_the_run_lengths_of_lucas_and_saccucci() {
        const SHIFTS: [f64; 9] = [0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0];
        for (lambda, limit, printed) in [
            (0.40, 3.054, [224.0, 71.2, 28.4, 14.3, 5.9, 3.5, 2.5, 2.0, 1.4]),
            (0.25, 2.998, [170.0, 48.2, 20.1, 11.1, 5.5, 3.6, 2.7, 2.3, 1.7]),
            (0.10, 2.814, [106.0, 31.3, 15.9, 10.3, 6.1, 4.4, 3.4, 2.9, 2.2]),
            (0.05, 2.615, [84.1, 28.8, 16.4, 11.4, 7.1, 5.2, 4.2, 3.5, 2.7]),
        ] {
            let unchanged = ewma(lambda).average_run_length(limit, 0.0);
            assert!((unchanged / 500.0 - 1.0).abs() < 0.004, "{lambda}: {unchanged}");
            assert!((ewma(lambda).limit_for(500.0) - limit).abs() < 0.002, "{lambda}");
            for (shift, printed) in SHIFTS.into_iter().zip(printed) {
                let length = ewma(lambda).average_run_length(limit, shift);
                // Half of the last digit, and what their Markov chain of some hundred states errs by.
                let digit = if printed >= 100.0 { 1.0 } else { 0.1 };
                let allowed = 0.5 * digit + 0.004 * printed;
                assert!((length - printed).abs() <= allowed, "{lambda} {shift}: {length}");
            }
        }
    }

    /// Crowder, J. Quality Technology 21, 155, 1989: limits of two-sided EWMA charts of ARL 250, to two decimals.
    #[test]
    fn ewma_limits_are_those_of_crowder() {
        for (lambda, printed) in
            [(0.05, 2.32), (0.1, 2.55), (0.15, 2.65), (0.2, 2.72), (0.25, 2.76)]
        {
            let limit = ewma(lambda).limit_for(250.0);
            assert!((limit - printed).abs() < 0.0101, "{lambda}: {limit}");
        }
    }

    /// An EWMA of weight 1 is a Shewhart chart: 1/0.0027 runs at three standard errors.
    #[test]
    fn a_weight_of_one_is_a_shewhart_chart() {
        assert!((ewma(1.0).average_run_length(3.0, 0.0) - 370.398).abs() < 0.001);
        let one = Statistic::Ewma { lambda: 1.0, two_sided: false };
        assert!((one.average_run_length(3.0, 0.0) - 740.797).abs() < 0.002);
    }

    /// Lucas and Crosier, Technometrics 24, 199, 1982, Table 1: two-sided CUSUM, k = 0.5, h = 4 and 5.
    #[test]
    fn two_sided_cusums_have_the_run_lengths_of_lucas_and_crosier() {
        for (shift, of_4, of_5) in [
            (0.0, 168.0, 465.0),
            (0.25, 74.2, 139.0),
            (0.5, 26.6, 38.0),
            (1.0, 8.38, 10.4),
            (2.0, 3.34, 4.01),
        ] {
            for (h, printed) in [(4.0, of_4), (5.0, of_5)] {
                let length = cusum(0.5, true).average_run_length(h, shift);
                assert!((length / printed - 1.0).abs() < 0.005, "{h} {shift}: {length}");
            }
        }
        assert!((cusum(0.5, false).average_run_length(4.0, 0.0) - 335.4).abs() < 0.5);
        assert!((cusum(0.5, false).average_run_length(5.0, 0.0) - 930.9).abs() < 1.0);
    }

    /// Vance, J. Quality Technology 18, 188, 1986, Table 1: one-sided CUSUM, k = 0, h = 10.
    #[test]
    fn one_sided_cusums_have_the_run_lengths_of_vance() {
        for (shift, printed) in [
            (-0.25, 2071.51),
            (-0.125, 400.28),
            (0.0, 124.66),
            (0.25, 36.71),
            (0.5, 20.37),
            (1.0, 10.75),
        ] {
            let length = cusum(0.0, false).average_run_length(10.0, shift);
            assert!((length / printed - 1.0).abs() < 5e-4, "{shift}: {length}");
        }
    }

    /// Brook and Evans, Biometrika 59, 539, 1972, section 4.3, by their coarser chain: 117.59 and 3.75.
    #[test]
    fn the_markov_chain_of_brook_and_evans_agrees() {
        let length = |shift| cusum(0.5, false).average_run_length(3.0, shift);
        assert!((length(0.0) / 117.59 - 1.0).abs() < 0.002, "{}", length(0.0));
        assert!((length(1.5) / 3.75 - 1.0).abs() < 0.002, "{}", length(1.5));
    }

    /// Mean run length of charts on random scores, and its standard error.
    fn drawn(kind: ChartKind, sides: Sides, limit: f64, shift: f64, charts: u32) -> (f64, f64) {
        let mut draws = ChaCha8Rng::seed_from_u64(7);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..charts {
            let mut chart = Chart::default();
            let mut runs = 0.0;
            loop {
                runs += 1.0;
                let draw: f64 = StandardNormal.sample(&mut draws);
                if chart.step(kind, sides, draw + shift).abs() > limit {
                    break;
                }
            }
            sum += runs;
            squares += runs * runs;
        }
        let mean = sum / f64::from(charts);
        (mean, ((squares / f64::from(charts) - mean * mean) / f64::from(charts)).sqrt())
    }

    /// The charts themselves on random numbers, all kinds and sides, unchanged and changed.
    #[test]
    fn charts_on_random_scores_run_as_long_as_computed() {
        let kinds = [
            ChartKind::Ewma { lambda: 0.25 },
            ChartKind::Ewma { lambda: 0.05 },
            ChartKind::Cusum { k: 0.5 },
        ];
        for kind in kinds {
            for (sides, direction) in
                [(Sides::Rises, 1.0), (Sides::Falls, -1.0), (Sides::Both, 1.0)]
            {
                let statistic = kind.statistic(sides);
                let limit = statistic.limit_for(200.0);
                for shift in [0.0, 1.0] {
                    let computed = statistic.average_run_length(limit, shift);
                    let (mean, error) = drawn(kind, sides, limit, direction * shift, 4000);
                    // Four standard errors: one of these 18 comparisons fails by chance with 1 in 900, and the seed is fixed.
                    assert!(
                        (mean - computed).abs() < 4.0 * error,
                        "{kind:?} {sides:?} {shift}: {mean} ± {error}, computed {computed}"
                    );
                }
            }
        }
    }
}
