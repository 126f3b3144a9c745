//! Functions of one variable on [0, 1] as polynomials: the form in which every directivity enters the field kernel.
//!
//! A smooth function is one polynomial. A function with corners, such as a measured table, is one polynomial between each two corners.
//! The piece for a value is found without a search: the interval is divided into equal cells with at most one corner each, and each
//! cell has its corner and the pieces on both sides.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::simd::float::Float;
use super::simd::{MAX_LANES, Simd, Vector};

/// Terms of a series at first, and at most: an analytic directivity needs 12 to 40.
const FIRST_TERMS: usize = 32;
const MAX_TERMS: usize = 128;

/// Terms of a piece between two corners. A piece is at most a tenth of the interval wide, so that for functions that are smooth on
/// the scale of the interval each term is smaller than the one before by a factor of about 40.
const PIECE_TERMS: usize = 8;
const WIDEST_PIECE: f64 = 0.1;

/// Relative size of the terms that a series leaves out in double precision.
pub(super) const DOUBLE_TOLERANCE: f64 = 2e-15;
/// The same in single precision.
const SINGLE_TOLERANCE: f64 = 1e-8;

/// A function on [0, 1] in double precision.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fit {
    /// Pairs of an even and an odd coefficient in powers of 2 t - 1, as many as double and as single precision need. A kernel is prepared far more
    /// often than a function is fitted: at every place of a receiver that moves from drive to drive.
    Smooth { double: Vec<[f64; 2]>, single: Vec<[f64; 2]> },
    /// The ends of the pieces, ascending from 0 to 1, and the coefficients of each in powers of a variable from -1 to 1 across it.
    Pieces { ends: Vec<f64>, rows: Vec<[f64; PIECE_TERMS]> },
}

impl Fit {
    /// Whether it is one polynomial.
    pub fn is_smooth(&self) -> bool {
        matches!(self, Self::Smooth { .. })
    }

    /// Fits `function`, which may have `corners` (ascending) between 0 and 1.
    pub fn new(corners: &[f64], function: impl Fn(f64) -> f64) -> Self {
        Self::within(DOUBLE_TOLERANCE, corners, function)
    }

    /// The same for a function with a relative error of `tolerance`.
    pub fn within(tolerance: f64, corners: &[f64], function: impl Fn(f64) -> f64) -> Self {
        // A corner at an end is none; rounding may have moved it a little.
        let inner = corners.iter().filter(|&corner| (1e-6..1.0 - 1e-6).contains(corner));
        let corners: Vec<f64> = inner.copied().collect();
        if corners.is_empty() {
            let mut terms = FIRST_TERMS;
            let mut series = chebyshev(terms, &function);
            while terms < MAX_TERMS && !has_ended(&series) {
                terms *= 2;
                series = chebyshev(terms, &function);
            }
            let [double, single] = [DOUBLE_TOLERANCE, SINGLE_TOLERANCE]
                .map(|digits| pairs(&powers(above(&series, tolerance.max(digits)))));
            return Self::Smooth { double, single };
        }
        let mut ends = vec![0.0];
        for corner in corners.into_iter().chain([1.0]) {
            let from = *ends.last().expect("it begins with 0");
            let pieces = ((corner - from) / WIDEST_PIECE).ceil().max(1.0);
            ends.extend((1..pieces as usize).map(|n| from + (corner - from) * n as f64 / pieces));
            ends.push(corner);
        }
        let rows = ends
            .windows(2)
            .map(|piece| {
                let along = |t: f64| function(piece[0] + (piece[1] - piece[0]) * t);
                let mut row = [0.0; PIECE_TERMS];
                let coefficients = powers(&chebyshev(PIECE_TERMS, along));
                row.copy_from_slice(&coefficients);
                row
            })
            .collect();
        Self::Pieces { ends, rows }
    }

    /// The function in one precision.
    pub fn in_precision<T: Float>(&self) -> Lobe<T> {
        match self {
            Self::Smooth { double, single } => {
                let pairs = if T::REFINED { single } else { double };
                Lobe::Polynomial(pairs.iter().map(|pair| pair.map(T::of)).collect())
            }
            Self::Pieces { ends, rows } => Lobe::Pieces(Pieces::new(ends, rows)),
        }
    }
}

/// A function on [0, 1] in one precision.
#[derive(Debug, Clone)]
pub(super) enum Lobe<T> {
    /// Pairs of an even and an odd coefficient in powers of x = 2 t - 1: E(x²) + x O(x²), two sums that are computed independently.
    ///
    /// Powers take one operation a term where Chebyshev polynomials take two. They lose digits if Chebyshev coefficients decrease more
    /// slowly than (1 + √2)^-n; those of directivities decrease faster.
    Polynomial(Vec<[T; 2]>),
    Pieces(Pieces<T>),
}

impl<T: Float> Lobe<T> {
    /// The function at each lane's t in [0, 1].
    #[inline(always)]
    pub fn at<V: Vector<T>, const L: usize>(&self, t: Simd<T, V, L>) -> Simd<T, V, L> {
        match self {
            Self::Polynomial(pairs) => polynomial(pairs, t),
            Self::Pieces(pieces) => pieces.at(t)[0],
        }
    }

    /// The same for a function without corners: the code for it needs no registers for pieces.
    #[inline(always)]
    pub fn smooth_at<V: Vector<T>, const L: usize>(&self, t: Simd<T, V, L>) -> Simd<T, V, L> {
        match self {
            Self::Polynomial(pairs) => polynomial(pairs, t),
            Self::Pieces(_) => unreachable!("a function without corners is one polynomial"),
        }
    }

    /// The function and its derivative by t.
    #[inline(always)]
    pub fn with_slope<V: Vector<T>, const L: usize>(&self, t: Simd<T, V, L>) -> [Simd<T, V, L>; 2] {
        match self {
            Self::Polynomial(pairs) => polynomial_with_slope(pairs, t),
            Self::Pieces(pieces) => pieces.at(t),
        }
    }

    /// The same for a function without corners: the code for it needs no registers for pieces.
    #[inline(always)]
    pub fn smooth_with_slope<V: Vector<T>, const L: usize>(
        &self,
        t: Simd<T, V, L>,
    ) -> [Simd<T, V, L>; 2] {
        match self {
            Self::Polynomial(pairs) => polynomial_with_slope(pairs, t),
            Self::Pieces(_) => unreachable!("a function without corners is one polynomial"),
        }
    }
}

/// A polynomial of 2 t - 1, by its pairs of coefficients.
#[inline(always)]
fn polynomial<T: Float, V: Vector<T>, const L: usize>(
    pairs: &[[T; 2]],
    t: Simd<T, V, L>,
) -> Simd<T, V, L> {
    let x = t.scale_add(T::of(2.0), Simd::splat(-T::ONE));
    let square = x.square();
    let Some((highest, lower)) = pairs.split_last() else { return Simd::zero() };
    let [mut even, mut odd] = highest.map(Simd::splat);
    for &pair in lower.iter().rev() {
        even = even.mul_add(square, Simd::splat(pair[0]));
        odd = odd.mul_add(square, Simd::splat(pair[1]));
    }
    odd.mul_add(x, even)
}

/// A polynomial of 2 t - 1, by its pairs of coefficients, and its derivative by t.
#[inline(always)]
fn polynomial_with_slope<T: Float, V: Vector<T>, const L: usize>(
    pairs: &[[T; 2]],
    t: Simd<T, V, L>,
) -> [Simd<T, V, L>; 2] {
    let x = t.scale_add(T::of(2.0), Simd::splat(-T::ONE));
    let square = x.square();
    let Some((highest, lower)) = pairs.split_last() else { return [Simd::zero(); 2] };
    let [mut even, mut odd] = highest.map(Simd::splat);
    let [mut even_slope, mut odd_slope] = [Simd::zero(); 2];
    if let Some((second, lower)) = lower.split_last() {
        [even_slope, odd_slope] = [even, odd];
        even = even.mul_add(square, Simd::splat(second[0]));
        odd = odd.mul_add(square, Simd::splat(second[1]));
        for &pair in lower.iter().rev() {
            even_slope = even_slope.mul_add(square, even);
            odd_slope = odd_slope.mul_add(square, odd);
            even = even.mul_add(square, Simd::splat(pair[0]));
            odd = odd.mul_add(square, Simd::splat(pair[1]));
        }
    }
    // d/dx of E(x²) + x O(x²), and dx/dt = 2.
    let slope = (x + x).mul_add(odd_slope.mul_add(x, even_slope), odd);
    [odd.mul_add(x, even), slope + slope]
}

/// Pieces between corners, and cells to find them.
#[derive(Debug, Clone)]
pub(super) struct Pieces<T> {
    cells: Vec<Cell<T>>,
    pieces: Vec<Piece<T>>,
}

#[derive(Debug, Clone, Copy)]
struct Cell<T> {
    /// The end within the cell, or beyond it.
    end: T,
    /// The piece below that end.
    piece: u32,
}

#[derive(Debug, Clone, Copy)]
struct Piece<T> {
    middle: T,
    /// One over half its width.
    scale: T,
    coefficients: [T; PIECE_TERMS],
}

impl<T: Float> Pieces<T> {
    fn new(ends: &[f64], rows: &[[f64; PIECE_TERMS]]) -> Self {
        let narrowest = ends.windows(2).map(|piece| piece[1] - piece[0]).fold(1.0, f64::min);
        let count = (1.0 / narrowest).ceil() as usize + 1;
        let cells = (0..count)
            .map(|cell| {
                let from = cell as f64 / count as f64;
                let piece = ends[1..ends.len() - 1].partition_point(|&end| end <= from);
                Cell { end: T::of(ends[piece + 1]), piece: piece as u32 }
            })
            .collect();
        let pieces = ends
            .windows(2)
            .zip(rows)
            .map(|(piece, row)| Piece {
                middle: T::of(0.5 * (piece[0] + piece[1])),
                scale: T::of(2.0 / (piece[1] - piece[0])),
                coefficients: row.map(T::of),
            })
            .collect();
        Self { cells, pieces }
    }

    fn piece(&self, t: T) -> &Piece<T> {
        let cell = (t * T::of(self.cells.len() as f64)).index().min(self.cells.len() - 1);
        let Cell { end, piece } = self.cells[cell];
        let piece = piece as usize + usize::from(t >= end);
        &self.pieces[piece.min(self.pieces.len() - 1)]
    }

    /// Value and derivative.
    #[inline(always)]
    fn at<V: Vector<T>, const L: usize>(&self, t: Simd<T, V, L>) -> [Simd<T, V, L>; 2] {
        // The buffers are cleared each time: they are no larger than the lanes need.
        let count = Simd::<T, V, L>::COUNT;
        if count <= 16 {
            self.at_up_to::<V, L, 16>(t)
        } else if count <= 32 {
            self.at_up_to::<V, L, 32>(t)
        } else {
            self.at_up_to::<V, L, MAX_LANES>(t)
        }
    }

    /// The same for at most `ROOM` lanes.
    #[inline(always)]
    fn at_up_to<V: Vector<T>, const L: usize, const ROOM: usize>(
        &self,
        t: Simd<T, V, L>,
    ) -> [Simd<T, V, L>; 2] {
        let mut places = [T::ZERO; ROOM];
        t.store(&mut places);
        let mut scale = [T::ZERO; ROOM];
        let mut coefficients = [[T::ZERO; ROOM]; PIECE_TERMS];
        for lane in 0..Simd::<T, V, L>::COUNT {
            let piece = self.piece(places[lane]);
            scale[lane] = piece.scale;
            places[lane] = (places[lane] - piece.middle) * piece.scale;
            for (lanes, &coefficient) in coefficients.iter_mut().zip(&piece.coefficients) {
                lanes[lane] = coefficient;
            }
        }
        let x = Simd::load(&places);
        let [mut value, mut slope] = [Simd::zero(); 2];
        for coefficient in coefficients.iter().rev() {
            slope = slope.mul_add(x, value);
            value = value.mul_add(x, Simd::load(coefficient));
        }
        [value, slope * Simd::load(&scale)]
    }
}

/// Whether the last quarter of a series is negligible: aliases of the terms beyond its end would appear there.
fn has_ended(series: &[f64]) -> bool {
    let largest = |terms: &[f64]| terms.iter().fold(0.0f64, |largest, c| largest.max(c.abs()));
    largest(&series[3 * series.len() / 4..]) <= DOUBLE_TOLERANCE * largest(series)
}

/// The first coefficients of a function on [0, 1] in Chebyshev polynomials of 2 t - 1, from its values at as many nodes
/// (L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, ch. 3).
fn chebyshev(terms: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    /// Those of the usual numbers of terms: a fit is made for each new set-up, and there are many.
    static USUAL: LazyLock<[Projection; 4]> = LazyLock::new(|| {
        [PIECE_TERMS, FIRST_TERMS, 2 * FIRST_TERMS, MAX_TERMS].map(Projection::of)
    });
    match USUAL.iter().find(|projection| projection.nodes.len() == terms) {
        Some(projection) => projection.series(function),
        None => Projection::of(terms).series(function),
    }
}

/// Where a function is asked for, and what its values there are multiplied by.
struct Projection {
    nodes: Vec<f64>,
    /// The part of each coefficient, value by value: sums over terms side by side.
    rows: Vec<f64>,
}

impl Projection {
    fn of(terms: usize) -> Self {
        let cosines: Vec<f64> =
            (0..4 * terms).map(|step| (0.5 * PI * step as f64 / terms as f64).cos()).collect();
        // cos(term * angle(node)), the argument reduced to one turn in integers, without rounding.
        let cosine = |term: usize, node: usize| cosines[(term * (2 * node + 1)) % (4 * terms)];
        let part = |term: usize, node: usize| {
            cosine(term, node) * if term == 0 { 1.0 } else { 2.0 } / terms as f64
        };
        Self {
            nodes: (0..terms).map(|node| 0.5 + 0.5 * cosine(1, node)).collect(),
            rows: (0..terms * terms).map(|n| part(n % terms, n / terms)).collect(),
        }
    }

    fn series(&self, function: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut series = vec![0.0; self.nodes.len()];
        for (row, node) in self.rows.chunks_exact(self.nodes.len()).zip(&self.nodes) {
            let value = function(*node);
            for (coefficient, part) in series.iter_mut().zip(row) {
                *coefficient += value * part;
            }
        }
        series
    }
}

/// A Chebyshev series without its last terms that are smaller than `tolerance` times the largest.
fn above(series: &[f64], tolerance: f64) -> &[f64] {
    let largest = series.iter().fold(0.0f64, |largest, c| largest.max(c.abs()));
    let last = series.iter().rposition(|c| c.abs() > tolerance * largest);
    &series[..last.map_or(0, |last| last + 1)]
}

/// Converts at most [`MAX_TERMS`] Chebyshev coefficients to those of powers.
fn powers(coefficients: &[f64]) -> Vec<f64> {
    static POLYNOMIALS: LazyLock<Vec<Vec<f64>>> = LazyLock::new(chebyshev_polynomials);
    let mut powers = vec![0.0; coefficients.len()];
    for (coefficient, polynomial) in coefficients.iter().zip(POLYNOMIALS.iter()) {
        for (power, t) in powers.iter_mut().zip(polynomial) {
            *power += coefficient * t;
        }
    }
    powers
}

/// The first [`MAX_TERMS`] Chebyshev polynomials in powers, by T(n+1) = 2 x T(n) - T(n-1).
fn chebyshev_polynomials() -> Vec<Vec<f64>> {
    let mut polynomials = vec![vec![1.0], vec![0.0, 1.0]];
    while let [.., before, current] = &polynomials[..]
        && polynomials.len() < MAX_TERMS
    {
        let mut next = vec![0.0; current.len() + 1];
        for (power, t) in current.iter().enumerate() {
            next[power + 1] = 2.0 * t;
        }
        for (power, t) in before.iter().enumerate() {
            next[power] -= t;
        }
        polynomials.push(next);
    }
    polynomials
}

/// Coefficients of powers in pairs of an even and an odd one.
fn pairs(powers: &[f64]) -> Vec<[f64; 2]> {
    powers.chunks(2).map(|pair| [pair[0], pair.get(1).copied().unwrap_or(0.0)]).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::simd::{Plain, Registers};

    type Fused = Plain<4, 8, true>;

    fn lanes(t: f64) -> Simd<f64, <Fused as Registers>::Double, 4> {
        Simd::splat(t)
    }

    proptest! {
        #[test]
        fn an_analytic_function_and_its_slope_are_reproduced(t in 0.0..=1.0f64, rate in 0.5..6.0f64) {
            let function = |t: f64| (rate * t).cos() * (-t * t).exp();
            let slope = -(rate * (rate * t).sin() + 2.0 * t * (rate * t).cos()) * (-t * t).exp();
            let lobe: Lobe<f64> = Fit::new(&[], function).in_precision();
            prop_assert!((lobe.at(lanes(t)).lane(0) - function(t)).abs() < 1e-13);
            prop_assert!((lobe.with_slope(lanes(t))[1].lane(5) - slope).abs() < 1e-11);
            let single: Lobe<f32> = Fit::new(&[], function).in_precision();
            let ours = single.at(Simd::<f32, <Fused as Registers>::Single, 4>::splat(t as f32)).lane(7);
            prop_assert!((f64::from(ours) - function(t)).abs() < 2e-6);
        }

        #[test]
        fn functions_with_corners_are_reproduced(
            t in 0.0..=1.0f64, corners in prop::collection::btree_set(1u32..500, 1..30), heights in prop::array::uniform4(-1.0..1.0f64),
        ) {
            let corners: Vec<f64> = corners.into_iter().map(|n| f64::from(n) / 500.0).collect();
            let function = |t: f64| {
                let bend = |(n, corner): (usize, &f64)| heights[n % 4] * (t - corner).abs();
                corners.iter().enumerate().map(bend).sum::<f64>() + (3.0 * t).sin()
            };
            let lobe: Lobe<f64> = Fit::new(&corners, function).in_precision();
            prop_assert!((lobe.at(lanes(t)).lane(3) - function(t)).abs() < 1e-12, "{}", t);
        }
    }

    #[test]
    fn a_constant_has_one_pair_of_terms_and_zero_has_none() {
        let terms = |function: fn(f64) -> f64| match Fit::new(&[], function).in_precision::<f64>() {
            Lobe::Polynomial(pairs) => pairs.len(),
            Lobe::Pieces(_) => panic!("no corners were given"),
        };
        assert_eq!((terms(|_| 2.5), terms(|_| 0.0)), (1, 0));
    }

    #[test]
    fn chebyshev_polynomials_are_converted_to_powers() {
        // T4 = 8 x^4 - 8 x^2 + 1
        assert_eq!(powers(&[0.0, 0.0, 0.0, 0.0, 1.0]), [1.0, 0.0, -8.0, 0.0, 8.0]);
        assert_eq!(powers(&[1.0, 2.0]), [1.0, 2.0]);
    }
}
