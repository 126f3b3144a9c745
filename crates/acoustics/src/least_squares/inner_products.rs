//! Products of columns, each with each, summed over their rows: the matrix of the normal equations.

use nalgebra::DMatrix;
use rayon::prelude::*;

/// Columns from which on the products are computed in blocks, by several threads: fewer are not worth a task.
const MANY: usize = 64;

/// Columns of a block.
const BLOCK: usize = 64;

/// The scalar product of each column with each other: entry (i, j) is that of the columns i and j, which are of equal length.
///
/// The same columns give the same bits on the same kind of processor.
pub fn inner_products(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let n = columns.len();
    if n < MANY {
        let mut products = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in 0..=j {
                products[(i, j)] = dot(&columns[i], &columns[j]);
            }
        }
        products.fill_lower_triangle_with_upper_triangle();
        return products;
    }
    let blocks: Vec<(DMatrix<f64>, DMatrix<f64>)> = columns
        .par_chunks(BLOCK)
        .map(|columns| {
            let rows = columns[0].len();
            let entries = columns.iter().flatten().copied();
            let block = DMatrix::from_iterator(rows, columns.len(), entries);
            (block.transpose(), block)
        })
        .collect();
    let pairs: Vec<(usize, usize)> =
        (0..blocks.len()).flat_map(|j| (0..=j).map(move |i| (i, j))).collect();
    // Each product of blocks is a sum of its own, so that threads do not change it.
    let of_blocks: Vec<DMatrix<f64>> =
        pairs.par_iter().map(|&(i, j)| &blocks[i].0 * &blocks[j].1).collect();
    let mut products = DMatrix::zeros(n, n);
    for ((i, j), of_pair) in pairs.into_iter().zip(of_blocks) {
        products.view_mut((i * BLOCK, j * BLOCK), of_pair.shape()).copy_from(&of_pair);
    }
    products.fill_lower_triangle_with_upper_triangle();
    products
}

/// The same, where the first columns are those of known products.
pub(super) fn inner_products_beside(known: &DMatrix<f64>, columns: &[Vec<f64>]) -> DMatrix<f64> {
    let (first, n) = (known.nrows(), columns.len());
    let mut products = DMatrix::zeros(n, n);
    products.view_mut((0, 0), known.shape()).copy_from(known);
    for j in first..n {
        for i in 0..=j {
            products[(i, j)] = dot(&columns[i], &columns[j]);
        }
    }
    products.fill_lower_triangle_with_upper_triangle();
    products
}

/// Scalar product, in eight partial sums that the processor computes together; always in the same order.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against sums one by one, for few columns and for whole and broken blocks of many.
    #[test]
    fn each_product_is_that_of_its_columns() {
        for (count, rows) in [(3, 17), (64, 40), (150, 1001), (70, 0)] {
            let entry = |j: usize, i: usize| ((7 * i + 13 * j * j) as f64).sin();
            let columns: Vec<Vec<f64>> =
                (0..count).map(|j| (0..rows).map(|i| entry(j, i)).collect()).collect();
            let products = inner_products(&columns);
            for (i, one) in columns.iter().enumerate() {
                for (j, other) in columns.iter().enumerate() {
                    let sum: f64 = one.iter().zip(other).map(|(a, b)| a * b).sum();
                    assert!((products[(i, j)] - sum).abs() < 1e-10, "{count} {rows}: {i} {j}");
                }
            }
            let first = 2 * count / 3;
            let beside = inner_products_beside(&inner_products(&columns[..first]), &columns);
            assert!((beside - products).amax() < 1e-10, "{count} {rows}");
        }
    }
}
