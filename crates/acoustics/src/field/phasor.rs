//! Complex numbers in vectors.

use std::ops::{Add, Sub};

use crate::simd::float::Float;
use crate::simd::{Simd, Vector};

/// Real and imaginary parts of the numbers in `L` vectors.
#[derive(Clone, Copy)]
pub(super) struct Phasor<T, V, const L: usize>(pub [Simd<T, V, L>; 2]);

impl<T: Float, V: Vector<T>, const L: usize> Add for Phasor<T, V, L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self([self.0[0] + other.0[0], self.0[1] + other.0[1]])
    }
}

impl<T: Float, V: Vector<T>, const L: usize> Sub for Phasor<T, V, L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self([self.0[0] - other.0[0], self.0[1] - other.0[1]])
    }
}

impl<T: Float, V: Vector<T>, const L: usize> Phasor<T, V, L> {
    /// Times a real factor.
    #[inline(always)]
    pub fn scaled(self, factor: Simd<T, V, L>) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor])
    }

    /// Times i.
    #[inline(always)]
    pub fn turned(self) -> Self {
        let [real, imaginary] = self.0;
        Self([Simd::zero() - imaginary, real])
    }

    /// Times `scale - i turn`.
    #[inline(always)]
    pub fn scaled_and_turned_back(self, scale: Simd<T, V, L>, turn: Simd<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([turn.mul_add(imaginary, scale * real), turn.mul_sub_from(real, scale * imaginary)])
    }

    /// Plus another times a real factor.
    #[inline(always)]
    pub fn plus(self, other: Self, factor: Simd<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[0].mul_add(factor, real), other.0[1].mul_add(factor, imaginary)])
    }

    /// Plus i times another times a real factor.
    #[inline(always)]
    pub fn plus_turned(self, other: Self, factor: Simd<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[1].mul_sub_from(factor, real), other.0[0].mul_add(factor, imaginary)])
    }

    /// Minus i times another times a real factor.
    #[inline(always)]
    pub fn minus_turned(self, other: Self, factor: Simd<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[1].mul_add(factor, real), other.0[0].mul_sub_from(factor, imaginary)])
    }

    /// Minus another times a real factor.
    #[inline(always)]
    pub fn minus(self, other: Self, factor: Simd<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[0].mul_sub_from(factor, real), other.0[1].mul_sub_from(factor, imaginary)])
    }
}
