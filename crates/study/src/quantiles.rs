//! Quantiles of the figures of random arrays.

use serde::Serialize;

/// Quantiles, mean and standard deviation of some values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    /// 5 % quantile.
    pub p05: f64,
    /// 25 % quantile.
    pub p25: f64,
    /// Median.
    pub median: f64,
    /// 75 % quantile.
    pub p75: f64,
    /// 95 % quantile.
    pub p95: f64,
    /// The mean.
    pub mean: f64,
    /// Sample standard deviation (n - 1 degrees of freedom); zero for one value.
    pub standard_deviation: f64,
}

impl Quantiles {
    /// Quantiles of finite values, linearly interpolated in rank; `None` if there are none.
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
    fn quantiles_are_interpolated_in_rank() {
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
