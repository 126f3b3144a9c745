//! How figures of arrays drawn at random are distributed.

use serde::Serialize;

/// Where a share of some values lies below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// A twentieth lies below.
    pub p05: f64,
    /// A quarter lies below.
    pub p25: f64,
    /// Half lie below.
    pub median: f64,
    /// Three quarters lie below.
    pub p75: f64,
    /// All but a twentieth lie below.
    pub p95: f64,
    /// The mean.
    pub mean: f64,
    /// The standard deviation of one value, with one degree of freedom taken off; zero for one value.
    pub standard_deviation: f64,
}

impl Quantiles {
    /// Of some finite values, linearly between neighbours in rank; `None` if there are none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |share: f64| {
            let rank = share * last as f64;
            let below = rank.floor() as usize;
            let above = (below + 1).min(last);
            values[below] + (rank - below as f64) * (values[above] - values[below])
        };
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Some(Self {
            p05: at(0.05),
            p25: at(0.25),
            median: at(0.5),
            p75: at(0.75),
            p95: at(0.95),
            mean,
            standard_deviation: (squares / (count - 1.0).max(1.0)).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_shared_out_between_neighbours() {
        let found = Quantiles::of((0..=20).rev().map(f64::from)).expect("some");
        assert_eq!(
            [found.p05, found.p25, found.median, found.p75, found.p95],
            [1.0, 5.0, 10.0, 15.0, 19.0]
        );
        // The variance of 0..=20 is 21 * 22 / 12.
        assert!((found.standard_deviation.powi(2) - 38.5).abs() < 1e-12 && found.mean == 10.0);
        let lone = Quantiles::of([3.0]).expect("one");
        assert_eq!((lone.p05, lone.p95, lone.standard_deviation), (3.0, 3.0, 0.0));
        assert_eq!(Quantiles::of([]), None);
    }
}
