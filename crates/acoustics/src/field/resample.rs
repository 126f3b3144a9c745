//! Interpolation from a coarse grid to a fine one, for fields without structure finer than the coarse grid resolves.
//!
//! Each value is a weighted sum of its neighbours. The weights are a sinc function with a Kaiser window (J. F. Kaiser and R. W. Schafer,
//! IEEE Trans. ASSP 28, 105 (1980)).

use std::f64::consts::PI;

use num_complex::Complex64;
use rayon::prelude::*;

use super::instruction_set::{InstructionSet, Vectorised};
use crate::simd::{Registers, Simd};

/// Neighbours of a value; half of them to each side.
pub(super) const TAPS: usize = 40;

/// Attenuation of the window beyond the band, dB.
const STOP_DB: f64 = 205.0;

/// Width of the step of the window's spectrum, radians a sample (Kaiser and Schafer, equation 8).
const TRANSITION: f64 = (STOP_DB - 8.0) / (2.285 * TAPS as f64);

/// The coarsest step that resolves structure up to a wavenumber (rad/m) with this window.
pub(super) fn coarsest_step_m(band_rad_m: f64) -> f64 {
    (PI - 0.5 * TRANSITION) / band_rad_m
}

/// Numbers kept beyond a map's last, so that a whole vector may be read at any position.
pub(super) const BEYOND: usize = 32;

/// Complex numbers on a grid, rows of columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    pub real: Vec<f64>,
    pub imaginary: Vec<f64>,
    rows: usize,
    columns: usize,
}

impl Map {
    pub fn zero(rows: usize, columns: usize) -> Self {
        let none = vec![0.0; rows * columns + BEYOND];
        Self { real: none.clone(), imaginary: none, rows, columns }
    }

    /// The map of a field, row by row.
    pub fn of(field: &[Complex64], columns: usize) -> Self {
        let mut map = Self::zero(field.len() / columns.max(1), columns);
        for (place, value) in field.iter().enumerate() {
            map.real[place] = value.re;
            map.imaginary[place] = value.im;
        }
        map
    }

    /// The value of a number, row by row.
    pub fn at(&self, number: usize) -> Complex64 {
        Complex64::new(self.real[number], self.imaginary[number])
    }

    /// The field, row by row.
    pub fn joined(&self) -> Vec<Complex64> {
        let both = self.real.iter().zip(&self.imaginary).take(self.rows * self.columns);
        both.map(|(&re, &im)| Complex64::new(re, im)).collect()
    }

    /// Real and imaginary parts of each row.
    pub fn rows_mut(&mut self) -> impl IndexedParallelIterator<Item = (&mut [f64], &mut [f64])> {
        self.parts_mut(self.columns)
    }

    /// Real and imaginary parts of all values, in pieces of a length.
    pub fn parts_mut(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = (&mut [f64], &mut [f64])> {
        let (length, all) = (length.max(1), self.rows * self.columns);
        let real = self.real[..all].par_chunks_mut(length);
        real.zip(self.imaginary[..all].par_chunks_mut(length))
    }

    pub fn transposed(&self) -> Self {
        let mut turned = Self::zero(self.columns, self.rows);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (from, to) = (row * self.columns + column, column * self.rows + row);
                turned.real[to] = self.real[from];
                turned.imaginary[to] = self.imaginary[from];
            }
        }
        turned
    }
}

/// The positions of a grid's rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rows {
    pub first_m: f64,
    pub step_m: f64,
    pub count: usize,
}

impl Rows {
    pub fn at(self, row: usize) -> f64 {
        self.first_m + row as f64 * self.step_m
    }
}

/// Rows at the positions `to_m`, from those of `map` at `rows`, which extend beyond both ends of `to_m` by half of [`TAPS`] or more.
pub(super) fn resampled(instructions: InstructionSet, map: &Map, rows: Rows, to_m: &[f64]) -> Map {
    let mut out = Map::zero(to_m.len(), map.columns);
    out.rows_mut().zip(to_m).for_each(|((real, imaginary), &at_m)| {
        let place = (at_m - rows.first_m) / rows.step_m;
        let first = (place.floor() as usize + 1).saturating_sub(TAPS / 2);
        let first = first.min(map.rows.saturating_sub(TAPS));
        let terms: [Term; TAPS] = std::array::from_fn(|tap| Term {
            start: (first + tap) * map.columns,
            weight: [weight(place - (first + tap) as f64), 0.0],
        });
        instructions.run(WeightedSum::<false> { map, terms: &terms, real, imaginary });
    });
    out
}

/// The window's weight at a distance in samples.
fn weight(distance: f64) -> f64 {
    let beta = 0.1102 * (STOP_DB - 8.7);
    let share = distance / (0.5 * TAPS as f64);
    if share.abs() >= 1.0 {
        return 0.0;
    }
    let turn = PI * distance;
    let cardinal = if turn.abs() < 1e-9 { 1.0 } else { turn.sin() / turn };
    cardinal * bessel_i0(beta * (1.0 - share * share).sqrt()) / bessel_i0(beta)
}

/// The modified Bessel function of order zero, by its series, for arguments up to some tens.
fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut sum, mut term) = (1.0, 1.0);
    for n in 1..200 {
        term *= quarter / f64::from(n * n);
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

/// A piece of a map, from `start` on, times a complex weight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Term {
    pub start: usize,
    pub weight: [f64; 2],
}

/// The sum of pieces of a map, each times its weight; `COMPLEX` says whether weights have an imaginary part.
pub(super) struct WeightedSum<'w, const COMPLEX: bool> {
    pub map: &'w Map,
    pub terms: &'w [Term],
    pub real: &'w mut [f64],
    pub imaginary: &'w mut [f64],
}

impl<const COMPLEX: bool> Vectorised for WeightedSum<'_, COMPLEX> {
    #[inline(always)]
    fn run<R: Registers, const VECTORS: usize>(self) {
        const { assert!(Simd::<f64, R::Double, VECTORS>::COUNT <= BEYOND) };
        let columns = self.real.len();
        let at_once = Simd::<f64, R::Double, VECTORS>::COUNT;
        let mut ends = [0.0; BEYOND];
        for first in (0..columns).step_by(at_once) {
            let [mut real, mut imaginary] = [Simd::<f64, R::Double, VECTORS>::zero(); 2];
            for term in self.terms {
                // Numbers beyond the end of a row are summed, but not stored.
                let from = term.start + first;
                let re = Simd::load(&self.map.real[from..from + at_once]);
                let im = Simd::load(&self.map.imaginary[from..from + at_once]);
                let [a, b] = term.weight;
                real = re.scale_add(a, real);
                imaginary = im.scale_add(a, imaginary);
                if COMPLEX {
                    real = im.scale_add(-b, real);
                    imaginary = re.scale_add(b, imaginary);
                }
            }
            for (out, sums) in [(&mut *self.real, real), (&mut *self.imaginary, imaginary)] {
                let out = &mut out[first..];
                if out.len() >= at_once {
                    sums.store(out);
                } else {
                    sums.store(&mut ends);
                    out.copy_from_slice(&ends[..out.len()]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_within_the_band_is_interpolated_to_nine_digits() {
        let step_m = coarsest_step_m(800.0);
        let rows = Rows { first_m: -0.2, step_m, count: 200 };
        let to_m: Vec<f64> = (0..150).map(|n| -0.1 + 1e-3 * f64::from(n)).collect();
        for wavenumber in [0.0, 300.0, -733.0, 800.0] {
            let wave = |row: usize| Complex64::from_polar(1.0, wavenumber * rows.at(row));
            let field: Vec<Complex64> = (0..3 * rows.count).map(|n| wave(n / 3)).collect();
            let out = resampled(InstructionSet::best(), &Map::of(&field, 3), rows, &to_m).joined();
            for (row, &at_m) in to_m.iter().enumerate() {
                let error =
                    (out[3 * row + 2] - Complex64::from_polar(1.0, wavenumber * at_m)).norm();
                assert!(error < 5e-10, "{wavenumber} at {at_m}: {error}");
            }
        }
    }

    #[test]
    fn a_map_transposed_twice_is_itself() {
        let field: Vec<Complex64> = (0..6).map(|n| Complex64::new(f64::from(n), 1.0)).collect();
        let map = Map::of(&field, 3);
        let turned: Vec<f64> = map.transposed().joined().iter().map(|value| value.re).collect();
        assert_eq!(turned, [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
        assert_eq!(map.transposed().transposed(), map);
    }
}
