//! Standard errors for correlated residuals.
//!
//! The residual of a scan is not independent from point to point: its pattern is as wide as the structure of the field, half a wavelength
//! or more. With each reading counted as independent, every error would be too small by the square root of the readings in such a patch.
//! Readings are therefore grouped into blocks two wavelengths wide, and the scatter of the blocks' contributions gives the covariance (the
//! cluster-robust estimate of Liang and Zeger, Biometrika 73, 13, 1986). It assumes nothing about the pattern within a block.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::readings::Readings;

/// Width of a block, in wavelengths.
const WIDTH: f64 = 2.0;

/// Readings put into cubes two wavelengths wide, each drive apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocks {
    /// The block of each row of a fit; `None` for a prior.
    of: Vec<Option<usize>>,
    count: usize,
}

impl Blocks {
    /// The blocks of these readings.
    pub fn of(readings: &Readings) -> Self {
        let width_m = WIDTH * readings.wavelength_m();
        let mut known: BTreeMap<(usize, [i64; 3]), usize> = BTreeMap::new();
        let mut of = Vec::with_capacity(readings.len());
        for drive in readings.drives() {
            for position_m in &drive.positions_m {
                let cell = [0, 1, 2].map(|axis| (position_m[axis] / width_m).floor() as i64);
                let next = known.len();
                of.push(Some(*known.entry((drive.focus, cell)).or_insert(next)));
            }
        }
        Self { of, count: known.len() }
    }

    /// The same for rows of amplitudes, then rows of phases of the same readings, then so many priors.
    pub fn and_of_phases(mut self, priors: usize) -> Self {
        self.of.extend_from_within(..);
        self.of.extend(std::iter::repeat_n(None, priors));
        self
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Covariance of the coefficients of a linear least-squares fit with these columns that leaves this residual; a prior's is its standard deviation,
    /// since what the fit leaves of it scatters less. The covariance is
    /// infinite where the columns do not fix the coefficients, or blocks are no more than coefficients.
    pub fn covariance(&self, columns: &DMatrix<f64>, residual: &[f64]) -> DMatrix<f64> {
        let n = columns.ncols();
        let unknown = || DMatrix::from_diagonal_element(n, n, f64::INFINITY);
        // Columns in units of their own length: metres and ratios side by side would spoil the inverse.
        let lengths = DVector::from_iterator(n, columns.column_iter().map(|column| column.norm()));
        if self.count <= n || lengths.iter().any(|length| *length <= 0.0) {
            return unknown();
        }
        let mut asked = DMatrix::zeros(n, self.count);
        let (mut curvature, mut of_priors) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (i, (row, block)) in columns.row_iter().zip(&self.of).enumerate() {
            let row = row.transpose().component_div(&lengths);
            let square = &row * row.transpose();
            match block {
                Some(block) => {
                    let mut block = asked.column_mut(*block);
                    block += &row * residual[i];
                }
                None => of_priors += &square * residual[i].powi(2),
            }
            curvature += square;
        }
        let Some(cholesky) = curvature.cholesky() else { return unknown() };
        let inverse = cholesky.inverse();
        let few = self.count as f64 / (self.count - n) as f64;
        let scaled = &inverse * (&asked * asked.transpose()) * &inverse * few
            + &inverse * of_priors * &inverse;
        scaled.component_div(&(&lengths * lengths.transpose()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks(of: Vec<usize>) -> Blocks {
        let count = of.iter().max().map_or(0, |last| last + 1);
        Blocks { of: of.into_iter().map(Some).collect(), count }
    }

    /// The mean of blocks that are each one number throughout: its error is that of as many numbers as blocks.
    #[test]
    fn readings_equal_to_their_neighbours_count_once() {
        let errors = [1.0, -1.0, 2.0, -2.0, 0.5, -0.5, 1.5, -1.5];
        let once = blocks((0..8).collect());
        let copied = blocks((0..80).map(|i| i / 10).collect());
        let ones = |n: usize| DMatrix::from_element(n, 1, 1.0);
        let copies: Vec<f64> = (0..80).map(|i| errors[i / 10]).collect();
        let expected: f64 = errors.iter().map(|e| e * e).sum::<f64>() / 64.0 * 8.0 / 7.0;
        assert!((once.covariance(&ones(8), &errors)[(0, 0)] - expected).abs() < 1e-12);
        assert!((copied.covariance(&ones(80), &copies)[(0, 0)] - expected).abs() < 1e-12);
    }

    #[test]
    fn a_parameter_without_effect_is_unknown() {
        let columns =
            DMatrix::from_fn(10, 2, |row, column| if column == 0 { row as f64 } else { 0.0 });
        let covariance = blocks((0..10).collect()).covariance(&columns, &[0.1; 10]);
        assert!(covariance[(1, 1)].is_infinite());
    }
}
