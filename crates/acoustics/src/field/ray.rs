//! The straight ray from a source to points: its length, its direction, and the path that the phase is computed for.

use super::case::Case;
use super::surroundings::Near;
use crate::float::Float;
use crate::simd::{Simd, Vector};
use crate::transducer::Smooth;

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

/// The direction of a ray relative to the axis of its source.
#[derive(Clone, Copy)]
pub(super) struct Direction<T, V, const L: usize> {
    /// The axis, a unit vector.
    pub normal: [T; 3],
    /// Whether the axis is z.
    pub upright: bool,
    /// Height above the plane of the source's face, m.
    pub height: Simd<T, V, L>,
    /// Cosine of the angle between ray and axis.
    pub cosine: Simd<T, V, L>,
}

impl<T: Float, V: Vector<T>, const L: usize> Direction<T, V, L> {
    #[inline(always)]
    pub fn new<C: Case>(source: &Near<T>, ray: &Ray<T, V, L>) -> Self {
        let z_axis = [T::ZERO, T::ZERO, T::ONE];
        let normal = if C::USUAL { z_axis } else { source.normal };
        let upright = C::UPRIGHT || (C::PLAIN_AIR && normal == z_axis);
        let height =
            if upright { ray.along[2] } else { Simd::dot_add(ray.along, normal, Simd::zero()) };
        Self { normal, upright, height, cosine: height * ray.inverse }
    }

    /// The variable in which a lobe is a polynomial.
    #[inline(always)]
    pub fn variable(&self, smooth: Smooth, ray: &Ray<T, V, L>) -> Simd<T, V, L> {
        match smooth {
            Smooth::InCosine => self.cosine,
            Smooth::InSineSquared if self.upright => ray.across_square * ray.inverse_square,
            Smooth::InSineSquared => self.cosine.mul_sub_from(self.cosine, Simd::splat(T::ONE)),
            Smooth::InHalfTangent => self.half_tangent(ray),
        }
    }

    /// tan(θ/2) = ρ/(d + h), with ρ from its own components: d² - h² would lose half the digits near the axis.
    #[inline(always)]
    fn half_tangent(&self, ray: &Ray<T, V, L>) -> Simd<T, V, L> {
        let ([x, y, z], [nx, ny, nz]) = (ray.along, self.normal);
        let [x, y, z] = [x - self.height * nx, y - self.height * ny, z - self.height * nz];
        let off_axis = x.mul_add(x, y.mul_add(y, z.square())).root();
        (off_axis / (ray.distance + self.height)).at_most(T::ONE)
    }
}

/// The path that the phase is computed for.
#[derive(Clone, Copy)]
pub(super) struct Path<T, V, const L: usize> {
    /// Geometric length and one over it.
    pub length: Simd<T, V, L>,
    pub inverse: Simd<T, V, L>,
    /// Acoustic length less the length of the path to the tile's middle, m.
    pub excess: Simd<T, V, L>,
}

impl<T: Float, V: Vector<T>, const L: usize> Path<T, V, L> {
    /// The path to each point.
    #[inline(always)]
    pub fn observed(source: &Near<T>, step: [Simd<T, V, L>; 3], ray: &Ray<T, V, L>) -> Self {
        let sum_of_ends = Simd::moved(ray.along, source.offset);
        Self::new(source, step, ray.distance, ray.inverse, sum_of_ends)
    }

    /// The path to the point above or below at the height where path lengths are frozen.
    #[inline(always)]
    pub fn frozen(source: &Near<T>, step: [Simd<T, V, L>; 3], ray: &Ray<T, V, L>) -> Self {
        let square = ray.across_square + source.rise * source.rise;
        let [length, inverse, _] = square.root_and_reciprocals();
        let [x, y, _] = Simd::moved(ray.along, source.offset);
        Self::new(source, step, length, inverse, [x, y, Simd::zero()])
    }

    /// In single precision the difference of two lengths has lost the digits that both have in common. One step of Newton's
    /// method for the difference restores them: with the difference of the squares, s·(r + r₀) for a step s from r₀ to r, the
    /// excess e solves e (e + 2 d₀) = s·(r + r₀).
    #[inline(always)]
    fn new(
        source: &Near<T>,
        step: [Simd<T, V, L>; 3],
        length: Simd<T, V, L>,
        inverse: Simd<T, V, L>,
        sum_of_ends: [Simd<T, V, L>; 3],
    ) -> Self {
        let rough = length - source.path;
        if !T::REFINED {
            return Self { length, inverse, excess: rough };
        }
        let [x, y, z] = step;
        let [sx, sy, sz] = sum_of_ends;
        let squares = x.mul_add(sx, y.mul_add(sy, z.mul_add(sz, Simd::splat(source.rounded_off))));
        let missing = rough.mul_sub_from(rough + (source.path + source.path), squares);
        let half = T::of(0.5);
        // Where the path is much shorter than that to the middle, the difference has all the digits it needs.
        let below = Simd::splat(half * source.path) - rough.abs();
        let excess = rough + (missing * inverse * half).only_where_above(below, T::ZERO);
        Self { length, inverse, excess }
    }
}
