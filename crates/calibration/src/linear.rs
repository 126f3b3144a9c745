//! Complex readings: the weights are a linear least squares problem with one solution.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Share of the largest curvature below which a pivot is rounding.
const ROUNDING: f64 = 1e-12;

/// Weights of a linear fit.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearFit {
    /// The weights.
    pub weights: Vec<Complex64>,
    /// Standard error of each weight's real part, and of its imaginary part, which is the same.
    pub errors: Vec<f64>,
    /// Squared residuals in units of the noise, per degree of freedom; one where nothing is left over.
    pub chi_square: f64,
}

/// The weights w for which `rows` · w is nearest to complex `readings`. Each row has one entry for each weight; `sd` is the standard
/// deviation of each reading's real part, and of its imaginary part, above zero.
///
/// The errors include the residual where it is larger than the noise. `None` if the rows do not determine the weights.
///
/// # Panics
/// If the numbers of rows, readings and deviations differ.
pub fn linear_fit(
    rows: &[Vec<Complex64>],
    readings: &[Complex64],
    sd: &[f64],
) -> Option<LinearFit> {
    assert!(rows.len() == readings.len() && rows.len() == sd.len(), "one reading for each row");
    let count = rows.first()?.len();
    if rows.len() < count {
        return None;
    }
    let matrix = DMatrix::from_fn(rows.len(), count, |row, k| rows[row][k] / sd[row]);
    let right = DVector::from_fn(rows.len(), |row, _| readings[row] / sd[row]);
    let curvature = matrix.ad_mul(&matrix);
    let largest = curvature.diagonal().iter().map(|entry| entry.re).fold(0.0, f64::max);
    let cholesky = curvature.cholesky()?;
    // What rounding leaves of a weight that is not determined.
    let least =
        cholesky.l_dirty().diagonal().iter().map(|entry| entry.re).fold(f64::INFINITY, f64::min);
    if least * least <= ROUNDING * largest {
        return None;
    }
    let weights = cholesky.solve(&matrix.ad_mul(&right));
    let inverse = cholesky.inverse();
    let left = (&matrix * &weights - &right).norm_squared();
    let freedom = 2 * (rows.len() - count);
    let chi_square = if freedom > 0 { left / freedom as f64 } else { 1.0 };
    let errors = (0..count).map(|k| (inverse[(k, k)].re.max(0.0) * chi_square.max(1.0)).sqrt());
    let errors = errors.collect();
    Some(LinearFit { weights: weights.iter().copied().collect(), errors, chi_square })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, SQRT_2};

    /// Walsh's functions by Sylvester's rule: orthogonal, so that each weight is a mean over all readings.
    fn hadamard(order: usize) -> Vec<Vec<Complex64>> {
        let sign = |row: usize, k: usize| {
            if (row & k).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
        };
        (0..order).map(|row| (0..order).map(|k| Complex64::from(sign(row, k))).collect()).collect()
    }

    #[test]
    fn hadamard_codes_share_the_noise_equally() {
        let rows = hadamard(8);
        let truth: Vec<Complex64> = (0..8)
            .map(|k| Complex64::from_polar(1.0 + 0.1 * f64::from(k), FRAC_PI_2 * f64::from(k)))
            .collect();
        let readings: Vec<Complex64> =
            rows.iter().map(|row| row.iter().zip(&truth).map(|(a, w)| a * w).sum()).collect();
        let fit = linear_fit(&rows, &readings, &[0.2; 8]).expect("determined");
        for (weight, truth) in fit.weights.iter().zip(&truth) {
            assert!((weight - truth).norm() < 1e-12);
        }
        // The mean of eight readings has the noise of one over the root of eight.
        assert!(fit.errors.iter().all(|error| (error - 0.2 / (2.0 * SQRT_2)).abs() < 1e-12));
    }

    #[test]
    fn what_is_left_over_widens_the_errors_and_too_few_rows_give_none() {
        let rows = [hadamard(4), hadamard(4)].concat();
        // Two sets of readings that differ by 2 in every reading: a residual of one in each.
        let readings: Vec<Complex64> =
            (0..8).map(|row| Complex64::new(if row < 4 { 1.0 } else { -1.0 }, 0.0)).collect();
        let fit = linear_fit(&rows, &readings, &[0.1; 8]).expect("determined");
        assert!((fit.chi_square - 100.0).abs() < 1e-9, "8 · 1 / 0.01 over 8");
        assert!((fit.errors[0] - 0.1 / 8f64.sqrt() * 10.0).abs() < 1e-9);
        assert!(linear_fit(&rows[..3], &readings[..3], &[0.1; 3]).is_none());
        let same = vec![vec![Complex64::ONE; 2]; 5];
        assert!(linear_fit(&same, &readings[..5], &[0.1; 5]).is_none());
    }
}
