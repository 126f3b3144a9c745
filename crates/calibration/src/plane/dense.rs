//! Products and factors of large matrices, on all threads.
//!
//! Each block of a result is one product, computed by one thread: threads do not change the bits.

use nalgebra::{DMatrix, DVector, Dyn, ViewStorage};
use rayon::prelude::*;

/// Columns of a block: its products fill a processor's second cache.
const BLOCK: usize = 192;

/// Order up to which a matrix is factored as it is.
const SMALL: usize = 96;

type View<'a, T> = nalgebra::Matrix<T, Dyn, Dyn, ViewStorage<'a, T, Dyn, Dyn, nalgebra::U1, Dyn>>;

/// Adds Jᵀ J to `sum`, for a few thousand rows of J. The products are of single precision: over this many rows rounding stays near 1e-5.
pub fn add_gram(sum: &mut DMatrix<f64>, rows: &DMatrix<f32>) {
    let n = rows.ncols();
    let starts: Vec<usize> = (0..n).step_by(BLOCK).collect();
    let width = |start: usize| BLOCK.min(n - start);
    let turned: Vec<DMatrix<f32>> =
        starts.par_iter().map(|&i| rows.columns(i, width(i)).transpose()).collect();
    let pairs: Vec<(usize, usize)> =
        (0..starts.len()).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
    let products: Vec<DMatrix<f32>> = pairs
        .par_iter()
        .map(|&(i, j)| &turned[i] * rows.columns(starts[j], width(starts[j])))
        .collect();
    for (&(i, j), product) in pairs.iter().zip(&products) {
        for (column, values) in product.column_iter().enumerate() {
            for (row, &value) in values.iter().enumerate() {
                let (row, column) = (starts[i] + row, starts[j] + column);
                sum[(row, column)] += f64::from(value);
                if i != j {
                    sum[(column, row)] += f64::from(value);
                }
            }
        }
    }
}

/// Adds Jᵀ r to `sum`.
pub fn add_down(sum: &mut DVector<f64>, rows: &DMatrix<f32>, residuals: &[f64]) {
    let of = |(k, sum): (usize, &mut f64)| {
        let terms = rows.column(k);
        *sum += terms.iter().zip(residuals).map(|(&slope, r)| f64::from(slope) * r).sum::<f64>();
    };
    sum.as_mut_slice().par_iter_mut().enumerate().for_each(of);
}

/// A · B, by blocks of columns.
fn product(a: &View<'_, f64>, b: &View<'_, f64>) -> DMatrix<f64> {
    if a.nrows() * a.ncols() * b.ncols() < SMALL * SMALL * SMALL {
        return a * b;
    }
    let starts: Vec<usize> = (0..b.ncols()).step_by(BLOCK).collect();
    let parts: Vec<DMatrix<f64>> =
        starts.par_iter().map(|&j| a * b.columns(j, BLOCK.min(b.ncols() - j))).collect();
    let mut product = DMatrix::zeros(a.nrows(), b.ncols());
    for (&j, part) in starts.iter().zip(&parts) {
        product.columns_mut(j, part.ncols()).copy_from(part);
    }
    product
}

/// The inverse of the lower triangular factor L of A = L Lᵀ: A⁻¹ is its transpose times itself. Halves are factored one after the
/// other, so that nearly all work is products of matrices. `None` if A is not positive definite.
pub fn inverse_factor(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    if n <= SMALL {
        let lower = a.clone().cholesky()?.l();
        return lower.solve_lower_triangular(&DMatrix::identity(n, n));
    }
    let (h, rest) = (n / 2, n - n / 2);
    let first = inverse_factor(&a.view((0, 0), (h, h)).into_owned())?;
    let across = product(&a.view((h, 0), (rest, h)), &first.transpose().as_view());
    let left =
        a.view((h, h), (rest, rest)) - product(&across.as_view(), &across.transpose().as_view());
    let second = inverse_factor(&left)?;
    let followed = product(&across.as_view(), &first.as_view());
    let below = -product(&second.as_view(), &followed.as_view());
    let mut inverse = DMatrix::zeros(n, n);
    inverse.view_mut((0, 0), (h, h)).copy_from(&first);
    inverse.view_mut((h, h), (rest, rest)).copy_from(&second);
    inverse.view_mut((h, 0), (rest, h)).copy_from(&below);
    Some(inverse)
}

/// The covariance L⁻ᵀ L⁻¹ of some parameters, from `inverse_factor`.
pub fn covariance(inverse_factor: &DMatrix<f64>, of: &[usize]) -> DMatrix<f64> {
    let columns = inverse_factor.select_columns(of);
    product(&columns.transpose().as_view(), &columns.as_view())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn products_and_factors_are_those_of_the_plain_method() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let rows = DMatrix::from_fn(2500, 230, |_, _| random.random::<f32>() - 0.5);
        let mut gram = DMatrix::zeros(230, 230);
        add_gram(&mut gram, &rows);
        let wide = rows.map(f64::from);
        let plain = wide.tr_mul(&wide);
        assert!((&gram - &plain).amax() < 1e-4 * plain.amax());
        let factor = inverse_factor(&plain).expect("positive definite");
        let inverse = plain.clone().try_inverse().expect("not singular");
        let all: Vec<usize> = (0..230).collect();
        let found = covariance(&factor, &all);
        assert!((&found - &inverse).amax() < 1e-9 * inverse.amax());
        let mut indefinite = plain;
        indefinite[(200, 200)] = -1.0;
        assert!(inverse_factor(&indefinite).is_none());
        let residuals: Vec<f64> = (0..2500).map(f64::from).collect();
        let expected = wide.tr_mul(&DVector::from_vec(residuals.clone()));
        let mut down = DVector::zeros(230);
        add_down(&mut down, &rows, &residuals);
        assert!((down - &expected).amax() < 1e-9 * expected.amax());
    }
}
