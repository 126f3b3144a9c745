//! Sums of shifted pieces of a map, several rows of the result at a time.
//!
//! Rows of a field that lie a step of the lattice apart are sums of the same rows of the map with other weights. A piece of the map
//! that has been loaded is therefore added to several rows: the sum then waits for arithmetic and not for memory.

use super::instruction_set::Vectorised;
use super::resample::{BEYOND, Map};
use crate::simd::{Registers, Simd, Vector};

/// Rows that are summed together: with two vectors of each, their sums take half of 32 registers.
pub(super) const TOGETHER: usize = 4;

/// A piece of a map, from `start` on, times a complex weight for each of `K` rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shifted<const K: usize> {
    pub start: usize,
    pub weights: [[f64; 2]; K],
}

/// Real and imaginary parts of a row.
pub(super) type Row<'r> = [&'r mut [f64]; 2];

/// Adds the pieces of a map, each moved on by `from` numbers and times its weights, to rows of equal length.
pub(super) struct ShiftedSum<'s, 'r, const K: usize> {
    pub map: &'s Map,
    pub terms: &'s [Shifted<K>],
    pub from: usize,
    pub rows: [Row<'r>; K],
}

impl<const K: usize> ShiftedSum<'_, '_, K> {
    #[inline(always)]
    fn add<R: Registers, const VECTORS: usize>(mut self) {
        const { assert!(Simd::<f64, R::Double, VECTORS>::COUNT <= BEYOND) };
        let at_once = Simd::<f64, R::Double, VECTORS>::COUNT;
        let columns = self.rows[0][0].len();
        for first in (0..columns).step_by(at_once) {
            let mut sums = [[Simd::<f64, R::Double, VECTORS>::zero(); 2]; K];
            for term in self.terms {
                // Numbers beyond the end of a row are summed, but not stored.
                let from = term.start + self.from + first;
                let re = Simd::load(&self.map.real[from..from + at_once]);
                let im = Simd::load(&self.map.imaginary[from..from + at_once]);
                for ([real, imaginary], &[a, b]) in sums.iter_mut().zip(&term.weights) {
                    *real = im.mul_sub_from(Simd::splat(b), re.scale_add(a, *real));
                    *imaginary = re.scale_add(b, im.scale_add(a, *imaginary));
                }
            }
            for (row, sums) in self.rows.iter_mut().zip(sums) {
                for (out, sum) in row.iter_mut().zip(sums) {
                    let mut numbers = [0.0; BEYOND];
                    sum.store(&mut numbers);
                    for (out, number) in out[first..].iter_mut().zip(&numbers[..at_once]) {
                        *out += number;
                    }
                }
            }
        }
    }
}

impl<const K: usize> Vectorised for ShiftedSum<'_, '_, K> {
    #[inline(always)]
    fn run<R: Registers, const VECTORS: usize>(self) {
        if K == 1 {
            self.add::<R, VECTORS>();
        } else if R::Double::MANY_REGISTERS {
            self.add::<R, 2>();
        } else {
            self.add::<R, 1>();
        }
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::InstructionSet;

    /// Rows of 37 numbers: whole vectors and a rest with every instruction set.
    #[test]
    fn rows_summed_together_are_those_of_the_definition() {
        let (columns, wide) = (37, 60);
        let value = |n: usize| Complex64::from_polar(1.0 + 0.01 * n as f64, 0.7 * n as f64);
        let field: Vec<Complex64> = (0..4 * wide).map(value).collect();
        let map = Map::of(&field, wide);
        let weight =
            |term: usize, k: usize| [0.3 * term as f64 - k as f64, 0.2 + (term * k) as f64];
        let terms: Vec<Shifted<3>> = [5, 61, 100]
            .iter()
            .enumerate()
            .map(|(n, &start)| Shifted { start, weights: std::array::from_fn(|k| weight(n, k)) })
            .collect();
        for &set in InstructionSet::ALL.iter().filter(|set| set.is_available()) {
            let mut out = vec![1.0; 6 * columns];
            let mut parts = out.chunks_mut(columns);
            let mut part = || parts.next().expect("six parts");
            let rows = std::array::from_fn(|_| [part(), part()]);
            set.run(ShiftedSum { map: &map, terms: &terms, from: 2, rows });
            for k in 0..3 {
                for column in 0..columns {
                    let truth: Complex64 =
                        terms.iter().fold(Complex64::new(1.0, 1.0), |sum, term| {
                            let [re, im] = term.weights[k];
                            sum + field[term.start + 2 + column] * Complex64::new(re, im)
                        });
                    let [re, im] = [0, 1].map(|part| out[(2 * k + part) * columns + column]);
                    let apart = (Complex64::new(re, im) - truth).norm();
                    assert!(apart < 1e-12, "{set:?}, row {k}, column {column}: {apart:e}");
                }
            }
        }
    }
}
