//! Cholesky's factor of a curvature or a covariance, and its inverse applied to many columns, in blocks and on all cores.
//!
//! Most of the time goes into products of matrices, which run near the speed of the processor; column by column the same took ten times as
//! long. (G. H. Golub and C. F. Van Loan, *Matrix Computations*, algorithm 4.2.)

use nalgebra::allocator::Allocator;
use nalgebra::{Cholesky, DMatrix, DefaultAllocator, Dim, Dyn, OMatrix};
use rayon::prelude::*;

/// Rows of a block: a block of this size and as many columns stay in the cache.
const BLOCK: usize = 64;

/// Columns that one thread takes at a time.
const CHUNK: usize = 128;

/// Cholesky's factor, lower triangular.
#[derive(Debug, Clone)]
pub struct Factor {
    lower: DMatrix<f64>,
}

impl Factor {
    /// The factor itself, lower triangular.
    pub fn lower(&self) -> &DMatrix<f64> {
        &self.lower
    }

    /// Of a symmetric matrix, of which the lower half is read; `None` if it is not positive definite.
    pub fn of(mut matrix: DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        if n <= BLOCK {
            return Some(Self { lower: matrix.cholesky()?.unpack() });
        }
        let mut from = 0;
        while from < n {
            let size = BLOCK.min(n - from);
            let to = from + size;
            let corner = matrix.view((from, from), (size, size)).clone_owned().cholesky()?.l();
            matrix.view_mut((from, from), (size, size)).copy_from(&corner);
            if to < n {
                // The panel below the corner is that of the matrix times the inverse of the corner's transpose.
                let panel = matrix.view((to, from), (n - to, size)).transpose();
                let panel = corner.solve_lower_triangular(&panel)?;
                matrix.view_mut((to, from), (n - to, size)).copy_from(&panel.transpose());
                let starts: Vec<usize> = (to..n).step_by(CHUNK).collect();
                let updates: Vec<(usize, DMatrix<f64>)> = starts
                    .into_par_iter()
                    .map(|start| {
                        let width = CHUNK.min(n - start);
                        let rows = panel.columns(start - to, n - start);
                        (start, rows.transpose() * panel.columns(start - to, width))
                    })
                    .collect();
                for (start, update) in updates {
                    let mut rest = matrix.view_mut((start, start), update.shape());
                    rest -= update;
                }
            }
            from = to;
        }
        for column in 1..n {
            matrix.view_mut((0, column), (column, 1)).fill(0.0);
        }
        Some(Self { lower: matrix })
    }

    /// The inverse of the lower factor times some columns.
    pub fn whitened(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let starts: Vec<usize> = (0..columns.ncols()).step_by(CHUNK).collect();
        let parts: Vec<DMatrix<f64>> = starts
            .into_par_iter()
            .map(|start| {
                let width = CHUNK.min(columns.ncols() - start);
                self.whitened_part(columns.columns(start, width).into_owned())
            })
            .collect();
        let mut whitened = DMatrix::zeros(columns.nrows(), columns.ncols());
        for (number, part) in parts.into_iter().enumerate() {
            whitened.columns_mut(number * CHUNK, part.ncols()).copy_from(&part);
        }
        whitened
    }

    fn whitened_part(&self, mut part: DMatrix<f64>) -> DMatrix<f64> {
        let (n, width) = part.shape();
        for from in (0..n).step_by(BLOCK) {
            let size = BLOCK.min(n - from);
            if from > 0 {
                let known = self.lower.view((from, 0), (size, from)) * part.rows(0, from);
                let mut rows = part.rows_mut(from, size);
                rows -= known;
            }
            let corner = self.lower.view((from, from), (size, size));
            let mut rows = part.view_mut((from, 0), (size, width));
            corner.solve_lower_triangular_mut(&mut rows);
        }
        part
    }

    /// The inverse of the matrix times a vector, or times some columns.
    pub fn solve<C: Dim>(&self, right: &OMatrix<f64, Dyn, C>) -> OMatrix<f64, Dyn, C>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        let mut solved = right.clone();
        self.lower.solve_lower_triangular_mut(&mut solved);
        self.lower.tr_solve_lower_triangular_mut(&mut solved);
        solved
    }

    /// The inverse of the matrix.
    pub fn inverse(&self) -> DMatrix<f64> {
        let n = self.lower.nrows();
        if n <= BLOCK {
            return Cholesky::pack_dirty(self.lower.clone()).inverse();
        }
        let root = self.whitened(&DMatrix::identity(n, n));
        root.transpose() * root
    }

    /// The logarithm of the determinant of the matrix.
    pub fn log_determinant(&self) -> f64 {
        2.0 * self.lower.diagonal().iter().map(|pivot| pivot.ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn it_solves_what_the_plain_factor_solves(size in 1usize..200, seed in 0u64..1000) {
            let number = |i: usize| ((i as f64 + seed as f64) * 0.754_877_666).fract() - 0.5;
            let root = DMatrix::from_fn(size, size, |i, j| number(i * size + j));
            let matrix = &root * root.transpose() + DMatrix::identity(size, size);
            let right = DVector::from_fn(size, |i, _| number(7 * i));
            let factor = Factor::of(matrix.clone()).expect("positive definite");
            let plain = matrix.clone().cholesky().expect("positive definite");
            prop_assert!((factor.solve(&right) - plain.solve(&right)).norm() < 1e-9);
            prop_assert!((factor.log_determinant() - plain.ln_determinant()).abs() < 1e-8);
            let columns = DMatrix::from_fn(size, 150, |i, j| number(i + 3 * j));
            let whitened = factor.whitened(&columns);
            let squares = whitened.transpose() * &whitened;
            let expected = columns.transpose() * plain.solve(&columns);
            prop_assert!((squares - expected).norm() < 1e-7);
            prop_assert!((factor.inverse() - plain.inverse()).norm() < 1e-8);
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let mut matrix = DMatrix::identity(100, 100);
        matrix[(90, 90)] = -1.0;
        assert!(Factor::of(matrix).is_none());
    }
}
