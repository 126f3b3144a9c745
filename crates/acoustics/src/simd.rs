//! Arithmetic on several numbers at a time, without branches, in vectors of the width that the processor has.

pub(crate) mod float;
mod vector;
#[cfg(target_arch = "x86_64")]
mod x86_64;

use std::marker::PhantomData;

use float::Float;
pub(super) use vector::{Plain, Registers, Vector};
#[cfg(target_arch = "x86_64")]
pub(super) use x86_64::{Avx2, Avx512};

/// The largest number of lanes with any instruction set.
pub(super) const MAX_LANES: usize = 64;

/// `N` vectors that go through the same arithmetic, so that the processor can work on one while it waits for another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simd<T, V, const N: usize>([V; N], PhantomData<T>);

macro_rules! lanewise {
    ($($operator:ident, $name:ident);*) => {$(
        impl<T: Float, V: Vector<T>, const N: usize> std::ops::$operator for Simd<T, V, N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                self.with(other, V::$name)
            }
        }
        impl<T: Float, V: Vector<T>, const N: usize> std::ops::$operator<T> for Simd<T, V, N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: T) -> Self {
                std::ops::$operator::$name(self, Self::splat(other))
            }
        }
    )*};
}

lanewise!(Add, add; Sub, sub; Mul, mul; Div, div);

impl<T: Float, V: Vector<T>, const N: usize> Simd<T, V, N> {
    /// How many numbers there are.
    pub const COUNT: usize = N * V::LANES;

    #[inline(always)]
    fn of(vectors: [V; N]) -> Self {
        Self(vectors, PhantomData)
    }

    /// Applies a function to each vector. `f` must be `#[inline(always)]`, which a closure is not.
    #[inline(always)]
    fn each(mut self, f: impl Fn(V) -> V) -> Self {
        for n in 0..N {
            self.0[n] = f(self.0[n]);
        }
        self
    }

    /// Applies a function to each vector and its counterpart.
    #[inline(always)]
    fn with(mut self, other: Self, f: impl Fn(V, V) -> V) -> Self {
        for n in 0..N {
            self.0[n] = f(self.0[n], other.0[n]);
        }
        self
    }

    #[inline(always)]
    pub fn splat(value: T) -> Self {
        Self::of([V::splat(value); N])
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(T::ZERO)
    }

    /// The first numbers of a slice that holds enough.
    #[inline(always)]
    pub fn load(from: &[T]) -> Self {
        let mut lanes = Self::zero();
        for n in 0..N {
            lanes.0[n] = V::load(&from[n * V::LANES..]);
        }
        lanes
    }

    /// Writes the numbers to the start of a slice that has room for them.
    #[inline(always)]
    pub fn store(self, to: &mut [T]) {
        for n in 0..N {
            self.0[n].store(&mut to[n * V::LANES..]);
        }
    }

    /// Writes the numbers in double precision to the start of a slice that has room for them.
    #[inline(always)]
    pub fn store_doubles(self, to: &mut [f64]) {
        for n in 0..N {
            self.0[n].store_doubles(&mut to[n * V::LANES..]);
        }
    }

    /// One of the numbers.
    #[cfg(test)]
    pub fn lane(self, lane: usize) -> T {
        let mut numbers = [T::ZERO; MAX_LANES];
        self.store(&mut numbers);
        numbers[lane]
    }

    /// `self * factor + addend`.
    #[inline(always)]
    pub fn mul_add(mut self, factor: Self, addend: Self) -> Self {
        for n in 0..N {
            self.0[n] = self.0[n].mul_add(factor.0[n], addend.0[n]);
        }
        self
    }

    /// `from - self * factor`.
    #[inline(always)]
    pub fn mul_sub_from(mut self, factor: Self, from: Self) -> Self {
        for n in 0..N {
            self.0[n] = self.0[n].mul_sub_from(factor.0[n], from.0[n]);
        }
        self
    }

    /// `self * factor + addend`, with the same factor in all lanes.
    #[inline(always)]
    pub fn scale_add(self, factor: T, addend: Self) -> Self {
        self.mul_add(Self::splat(factor), addend)
    }

    /// The scalar product of vectors, given by their components, with one vector, plus `addend`.
    #[inline(always)]
    pub fn dot_add([x, y, z]: [Self; 3], [a, b, c]: [T; 3], addend: Self) -> Self {
        x.scale_add(a, y.scale_add(b, z.scale_add(c, addend)))
    }

    /// Vectors, given by their components, moved by one vector.
    #[inline(always)]
    pub fn moved([x, y, z]: [Self; 3], [a, b, c]: [T; 3]) -> [Self; 3] {
        [x + a, y + b, z + c]
    }

    #[inline(always)]
    pub fn square(self) -> Self {
        self * self
    }

    /// The square root, its reciprocal, and the reciprocal of the number itself; for numbers above zero.
    #[inline(always)]
    pub fn root_and_reciprocals(self) -> [Self; 3] {
        let mut all = [self; 3];
        for n in 0..N {
            [all[0].0[n], all[1].0[n], all[2].0[n]] = self.0[n].root_and_reciprocals();
        }
        all
    }

    /// The square root.
    #[inline(always)]
    pub fn root(self) -> Self {
        self.each(V::root)
    }

    /// The lesser of each number and `most`.
    #[inline(always)]
    pub fn at_most(self, most: T) -> Self {
        self.with(Self::splat(most), V::lesser)
    }

    /// The greater of each number and `least`.
    #[inline(always)]
    pub fn at_least(self, least: T) -> Self {
        // NaN stays NaN.
        Self::splat(least).with(self, V::greater)
    }

    /// Each number without its sign.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.with(Self::zero() - self, V::greater)
    }

    /// `self` where the other is above a limit, zero elsewhere.
    #[inline(always)]
    pub fn only_where_above(mut self, other: Self, limit: T) -> Self {
        let limit = V::splat(limit);
        for n in 0..N {
            self.0[n] = self.0[n].only_where_above(other.0[n], limit);
        }
        self
    }

    /// A polynomial, constant term first (Horner's rule); zero without terms.
    #[inline(always)]
    pub fn polynomial(self, coefficients: &[T]) -> Self {
        let Some((&highest, lower)) = coefficients.split_last() else { return Self::zero() };
        let mut sum = Self::splat(highest);
        for &coefficient in lower.iter().rev() {
            sum = sum.mul_add(self, Self::splat(coefficient));
        }
        sum
    }

    /// Cosine and sine of an angle of less than 2^20 half turns, without their common sign; and the rounded half turns, from which
    /// [`Simd::negated_if_odd`] gets the sign.
    ///
    /// The angle minus the nearest whole number of half turns is within a quarter turn, where two short polynomials are enough. An odd
    /// number of half turns changes both signs.
    #[inline(always)]
    pub fn cos_sin_half_turns(self) -> [Self; 3] {
        let rounded = self + T::ROUNDER;
        let rest = self - (rounded - T::ROUNDER);
        let square = rest.square();
        [square.polynomial(T::COSINE), square.polynomial(T::SINE) * rest, rounded]
    }

    /// `-self` where the half turns are odd.
    #[inline(always)]
    pub fn negated_if_odd(self, half_turns: Self) -> Self {
        self.with(half_turns, V::negated_if_odd)
    }

    /// e to the power of each number. Far below zero the result is nearly zero; arguments that overflow are not allowed.
    #[inline(always)]
    pub fn exp(self) -> Self {
        let clamped = self.at_least(T::LEAST_POWER);
        let power = (clamped * T::LOG2_E + T::ROUNDER) - T::ROUNDER;
        // ln 2 in two parts, so that the remainder keeps its last digits.
        let rest = power.scale_add(T::MINUS_LN_2[1], power.scale_add(T::MINUS_LN_2[0], clamped));
        rest.polynomial(T::EXPONENTIAL) * power.each(V::two_to)
    }

    /// The natural logarithm of each number; for normal numbers above zero.
    ///
    /// The number is split into 2^e m with m within a factor √2 of 1. In ln m = 2 artanh((m-1)/(m+1)) each term of the series is
    /// smaller than the one before by a factor of 34.
    #[inline(always)]
    pub fn ln(self) -> Self {
        let exponent = self.each(V::exponent);
        let mantissa = self * (Self::zero() - exponent).each(V::two_to);
        let s = (mantissa - T::ONE) / (mantissa + T::ONE);
        let tail = s.square().polynomial(T::ARTANH) * s;
        exponent.scale_add(T::LN_2, tail)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::vector::Array;
    use super::*;

    /// The functions of each kind of vectors for one number in all lanes, read from one of the lanes.
    type Ask<T> = (&'static str, fn(T) -> Answers<T>);

    #[derive(Debug)]
    struct Answers<T> {
        cosine_and_sine: [T; 2],
        /// Root, its reciprocal, reciprocal of the number; and the root computed alone.
        roots: [T; 4],
        exp: T,
        ln: T,
    }

    fn ask<T: Float, V: Vector<T>>(x: T) -> Answers<T> {
        let lanes = Simd::<T, V, 3>::splat(x);
        let last = Simd::<T, V, 3>::COUNT - 1;
        let [cosine, sine, odd] = lanes.cos_sin_half_turns();
        let cosine_and_sine = [cosine, sine].map(|part| part.negated_if_odd(odd).lane(last));
        let [root, reciprocal, of_square] = lanes.root_and_reciprocals();
        let roots = [root, reciprocal, of_square, lanes.root()].map(|root| root.lane(last / 2));
        Answers { cosine_and_sine, roots, exp: lanes.exp().lane(0), ln: lanes.ln().lane(last) }
    }

    /// Every kind of vectors that the processor has.
    fn doubles() -> Vec<Ask<f64>> {
        #[allow(unused_mut, reason = "only x86-64 has more of them")]
        let mut all: Vec<Ask<f64>> = vec![
            ("plain", ask::<f64, Array<f64, 2, false>>),
            ("fused", ask::<f64, Array<f64, 4, true>>),
        ];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                all.push(("AVX2", ask::<f64, <Avx2 as Registers>::Double>));
            }
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                all.push(("AVX-512", ask::<f64, <Avx512 as Registers>::Double>));
            }
        }
        all
    }

    fn singles() -> Vec<Ask<f32>> {
        #[allow(unused_mut, reason = "only x86-64 has more of them")]
        let mut all: Vec<Ask<f32>> = vec![
            ("plain", ask::<f32, Array<f32, 4, false>>),
            ("fused", ask::<f32, Array<f32, 8, true>>),
        ];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                all.push(("AVX2", ask::<f32, <Avx2 as Registers>::Single>));
            }
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
                all.push(("AVX-512", ask::<f32, <Avx512 as Registers>::Single>));
            }
        }
        all
    }

    proptest! {
        #[test]
        fn cosine_and_sine_agree_with_the_library(half_turns in -5e3..5e3f64) {
            let angle = std::f64::consts::PI * (half_turns - 2.0 * (0.5 * half_turns).round());
            for (name, ask) in doubles() {
                let [cosine, sine] = ask(half_turns).cosine_and_sine;
                prop_assert!((cosine - angle.cos()).abs() < 4e-15, "{name}: {cosine} {}", angle.cos());
                prop_assert!((sine - angle.sin()).abs() < 4e-15, "{name}: {sine} {}", angle.sin());
            }
        }

        #[test]
        fn in_single_precision_cosine_and_sine_agree_to_its_last_digits(half_turns in -60.0..60.0f32) {
            let angle = std::f64::consts::PI * f64::from(half_turns);
            for (name, ask) in singles() {
                let [cosine, sine] = ask(half_turns).cosine_and_sine.map(f64::from);
                prop_assert!((cosine - angle.cos()).abs() < 4e-7, "{name}: {cosine}");
                prop_assert!((sine - angle.sin()).abs() < 4e-7, "{name}: {sine}");
            }
        }

        #[test]
        fn roots_agree_with_the_library(power in -60.0..60.0f64) {
            let x = power.exp2();
            for (name, ask) in doubles() {
                let roots = ask(x).roots;
                for (ours, true_root) in roots.into_iter().zip([x.sqrt(), 1.0 / x.sqrt(), 1.0 / x, x.sqrt()]) {
                    prop_assert!((ours / true_root - 1.0).abs() < 5e-16, "{name}: {roots:?}");
                }
            }
            let x = f64::from(x as f32);
            for (name, ask) in singles() {
                let roots = ask(x as f32).roots.map(f64::from);
                for (ours, true_root) in roots.into_iter().zip([x.sqrt(), 1.0 / x.sqrt(), 1.0 / x, x.sqrt()]) {
                    prop_assert!((ours / true_root - 1.0).abs() < 3e-7, "{name}: {roots:?}");
                }
            }
        }

        #[test]
        fn the_exponential_agrees_with_the_library(x in -700.0..700.0f64) {
            for (name, ask) in doubles() {
                prop_assert!((ask(x).exp / x.exp() - 1.0).abs() < 5e-15, "{name}");
            }
            let x = (x / 10.0) as f32;
            for (name, ask) in singles() {
                let apart = f64::from(ask(x).exp) / f64::from(x).exp() - 1.0;
                prop_assert!(apart.abs() < 3e-7, "{name}");
            }
        }

        #[test]
        fn the_logarithm_agrees_with_the_library(power in -60.0..60.0f64) {
            let x = power.exp2();
            for (name, ask) in doubles() {
                prop_assert!((ask(x).ln - x.ln()).abs() < 5e-15 * (1.0 + power.abs()), "{name}");
            }
            for (name, ask) in singles() {
                let apart = f64::from(ask(x as f32).ln) - x.ln();
                prop_assert!(apart.abs() < 2e-7 * (1.0 + power.abs()), "{name}");
            }
        }
    }

    #[test]
    fn half_turns_and_quarter_turns_are_exact_in_sign() {
        for (half_turns, cosine) in
            [(0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (-1.0, -1.0), (3.0, -1.0), (-4.0, 1.0)]
        {
            for (name, ask) in doubles() {
                let ours = ask(half_turns).cosine_and_sine[0];
                assert!((ours - cosine).abs() < 3e-15, "{name}, {half_turns}: {ours}");
            }
        }
    }

    #[test]
    fn the_root_of_zero_is_zero() {
        assert!(doubles().iter().all(|(_, ask)| ask(0.0).roots[3] == 0.0));
        assert!(singles().iter().all(|(_, ask)| ask(0.0).roots[3] == 0.0));
    }

    #[test]
    fn far_below_zero_the_exponential_vanishes_and_nan_stays_nan() {
        assert!(doubles().iter().all(|(_, ask)| ask(-1e9).exp < 1e-300));
        assert!(singles().iter().all(|(_, ask)| ask(-1e9).exp < 1e-36));
        assert!(doubles().iter().all(|(_, ask)| ask(f64::NAN).exp.is_nan()));
    }
}
