//! What tests of the least squares fit.

use super::{Linearisation, Parameter};

pub fn free(start: f64, scale: f64) -> Parameter {
    Parameter { start, scale, prior: None, range: None }
}

/// Three exponential decays of known amplitudes: smooth, but not linear.
pub fn decays(rates: &[f64]) -> Linearisation {
    let at: Vec<f64> = (0..40).map(|i| 0.1 * f64::from(i)).collect();
    let of = |rates: &[f64], t: f64| -> f64 { rates.iter().map(|r| (-r * t).exp()).sum() };
    Linearisation {
        residuals: at.iter().map(|&t| 50.0 * (of(rates, t) - of(&[0.3, 1.0, 2.5], t))).collect(),
        columns: rates
            .iter()
            .map(|r| at.iter().map(|t| -50.0 * t * (-r * t).exp()).collect())
            .collect(),
    }
}
