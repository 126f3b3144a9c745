//! The mean air of a scan, with the errors of the means.

use fieldgap_records::AirRow;
use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

/// Mean temperature and humidity over a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AirFigures {
    /// Mean temperature, °C. Its error is that of the mean of what the sensor gave; that of the sensor is not in it.
    pub temperature_c: Uncertain,
    /// Mean relative humidity, %, where the sensor gave it.
    pub humidity_percent: Option<Uncertain>,
}

/// Fewest rows whose scatter says something about the mean.
const FEWEST: usize = 4;

impl AirFigures {
    /// Those of the rows of a record; `None` where there is no row.
    pub fn of(rows: &[AirRow]) -> Option<Self> {
        let temperatures: Vec<f64> = rows.iter().map(|row| row.temperature_c).collect();
        let humidities: Vec<f64> = rows.iter().filter_map(|row| row.humidity_percent).collect();
        Some(Self { temperature_c: mean(&temperatures)?, humidity_percent: mean(&humidities) })
    }
}

/// The mean of a series whose neighbours are alike. Its error is found from the means of batches, as many as the root of the number of rows,
/// so that a batch is long against the time over which the air changes (Flegal and Jones, Annals of Statistics 38, 1034, 2010).
fn mean(values: &[f64]) -> Option<Uncertain> {
    let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let value = values.first().map(|_| mean_of(values))?;
    if values.len() < FEWEST {
        return Some(Uncertain { value, standard_error: f64::NAN });
    }
    let length = values.len().isqrt();
    // The first rows that fill no batch have no part in the error.
    let batches: Vec<f64> = values.rchunks_exact(length).map(mean_of).collect();
    let count = batches.len() as f64;
    let mid = mean_of(&batches);
    let variance = batches.iter().map(|mean| (mean - mid).powi(2)).sum::<f64>() / (count - 1.0);
    Some(Uncertain { value, standard_error: (variance / count).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(temperatures_c: impl Iterator<Item = f64>) -> Vec<AirRow> {
        let row = |(n, temperature_c)| AirRow {
            time_s: 10.0 * f64::from(n),
            temperature_c,
            humidity_percent: None,
        };
        (0u32..).zip(temperatures_c).map(row).collect()
    }

    /// Uniform numbers in -0.5..0.5 (the generator of Numerical Recipes, 32 bit).
    fn noise(mut state: u32) -> impl Iterator<Item = f64> {
        std::iter::from_fn(move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            Some(f64::from(state) / f64::from(u32::MAX) - 0.5)
        })
    }

    /// The mean of n terms of x' = a x + e has the variance σ²/(n (1-a)²) of e in the limit of many.
    #[test]
    fn the_error_of_a_mean_counts_neighbours_that_are_alike_once() {
        let (a, n) = (0.8, 2500);
        let expected = (1.0 / 12.0f64).sqrt() / ((1.0 - a) * (n as f64).sqrt());
        let mut ratios = Vec::new();
        for seed in 0..40 {
            let mut level = 0.0;
            let series = noise(seed * 7919).map(|e| {
                level = a * level + e;
                20.0 + level
            });
            let air = AirFigures::of(&rows(series.take(n))).expect("rows");
            ratios.push(air.temperature_c.standard_error / expected);
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((0.85..1.1).contains(&mean), "{mean}");
    }

    #[test]
    fn few_rows_have_a_mean_without_an_error() {
        assert_eq!(AirFigures::of(&[]), None);
        let air = AirFigures::of(&rows([20.0, 21.0].into_iter())).expect("rows");
        assert_eq!(air.temperature_c.value, 20.5);
        assert!(air.temperature_c.standard_error.is_nan() && air.humidity_percent.is_none());
    }
}
