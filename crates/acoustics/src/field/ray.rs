//! The straight ray from a source to points, and the excess path that its phase is computed from.

use super::surroundings::Near;
use crate::simd::float::Float;
use crate::simd::{Simd, Vector};

/// Rays from a source to the points of `L` vectors.
#[derive(Clone, Copy)]
pub(super) struct Ray<T, V, const L: usize> {
    /// From source to point, m.
    pub along: [Simd<T, V, L>; 3],
    /// Squared distance from the line through the source along z, m².
    pub across_square: Simd<T, V, L>,
    /// Length, m.
    pub distance: Simd<T, V, L>,
    /// One over the length, and over its square.
    pub inverse: Simd<T, V, L>,
    pub inverse_square: Simd<T, V, L>,
}

impl<T: Float, V: Vector<T>, const L: usize> Ray<T, V, L> {
    /// Rays to points that lie `step` from the tile's middle.
    #[inline(always)]
    pub fn new(source: &Near<T>, step: [Simd<T, V, L>; 3]) -> Self {
        let along = Simd::moved(step, source.offset);
        let [x, y, z] = along;
        let across_square = x.mul_add(x, y.mul_add(y, Simd::splat(T::TINY)));
        let [distance, inverse, inverse_square] =
            z.mul_add(z, across_square).root_and_reciprocals();
        Self { along, across_square, distance, inverse, inverse_square }
    }
}

/// tan(θ/2) = ρ/(d + h), with ρ from its own components: d² - h² would lose half the digits near the axis.
#[inline(always)]
pub(super) fn half_tangent<T: Float, V: Vector<T>, const L: usize>(
    along: [Simd<T, V, L>; 3],
    normal: [T; 3],
    distance: Simd<T, V, L>,
    height: Simd<T, V, L>,
) -> Simd<T, V, L> {
    let [x, y, z] = along;
    let [x, y, z] = [x - height * normal[0], y - height * normal[1], z - height * normal[2]];
    let off_axis = x.mul_add(x, y.mul_add(y, z.square())).root();
    (off_axis / (distance + height)).at_most(T::ONE)
}

/// The excess path: length of a path less that of the path to the tile's middle, m.
///
/// In single precision the difference of two lengths has lost the digits that both have in common. One step of Newton's method for
/// the difference restores them: with the difference of the squares, s·(r + r₀) for a step s from r₀ to r, the excess e solves
/// e (e + 2 d₀) = s·(r + r₀).
#[inline(always)]
pub(super) fn excess<T: Float, V: Vector<T>, const L: usize>(
    source: &Near<T>,
    step: [Simd<T, V, L>; 3],
    path: Simd<T, V, L>,
    inverse: Simd<T, V, L>,
    sum_of_ends: [Simd<T, V, L>; 3],
) -> Simd<T, V, L> {
    let rough = path - source.path;
    if !T::REFINED {
        return rough;
    }
    let [x, y, z] = step;
    let [sx, sy, sz] = sum_of_ends;
    let squares = x.mul_add(sx, y.mul_add(sy, z.mul_add(sz, Simd::splat(source.rounded_off))));
    let missing = rough.mul_sub_from(rough + (source.path + source.path), squares);
    let half = T::of(0.5);
    // Where the path is much shorter than that to the middle, the difference has all the digits it needs.
    let below = Simd::splat(half * source.path) - rough.abs();
    rough + (missing * inverse * half).only_where_above(below, T::ZERO)
}
