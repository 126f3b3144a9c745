//! Several numbers at a time, without branches, so that the compiler turns each operation into vector instructions of
//! whatever width the processor has.
//!
//! `FUSED` says whether the processor multiplies and adds in one instruction; where it does not, `f64::mul_add` would be a
//! library call many times slower than the two operations.

use super::real::Real;

/// `WIDTH` numbers that go through the same arithmetic.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Lanes<T, const WIDTH: usize, const FUSED: bool>(pub [T; WIDTH]);

macro_rules! lanewise {
    ($($operator:ident, $name:ident: $op:tt);*) => {$(
        impl<T: Real, const W: usize, const F: bool> std::ops::$operator for Lanes<T, W, F> {
            type Output = Self;
            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for lane in 0..W {
                    self.0[lane] = self.0[lane] $op other.0[lane];
                }
                self
            }
        }
        impl<T: Real, const W: usize, const F: bool> std::ops::$operator<T> for Lanes<T, W, F> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: T) -> Self {
                std::ops::$operator::$name(self, Self::splat(other))
            }
        }
    )*};
}

lanewise!(Add, add: +; Sub, sub: -; Mul, mul: *; Div, div: /);

impl<T: Real, const W: usize, const FUSED: bool> Lanes<T, W, FUSED> {
    #[inline(always)]
    pub fn splat(value: T) -> Self {
        Self([value; W])
    }

    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(T::ZERO)
    }

    #[inline(always)]
    pub fn map(mut self, f: impl Fn(T) -> T) -> Self {
        for lane in 0..W {
            self.0[lane] = f(self.0[lane]);
        }
        self
    }

    /// `self * factor + addend`.
    #[inline(always)]
    pub fn mul_add(mut self, factor: Self, addend: Self) -> Self {
        for lane in 0..W {
            self.0[lane] = if FUSED {
                self.0[lane].fused(factor.0[lane], addend.0[lane])
            } else {
                self.0[lane] * factor.0[lane] + addend.0[lane]
            };
        }
        self
    }

    /// `from - self * factor`.
    #[inline(always)]
    pub fn mul_sub_from(mut self, factor: Self, from: Self) -> Self {
        for lane in 0..W {
            self.0[lane] = -self.0[lane];
        }
        self.mul_add(factor, from)
    }

    /// `self * factor + addend`, the factor alike in all lanes.
    #[inline(always)]
    pub fn scale_add(self, factor: T, addend: Self) -> Self {
        self.mul_add(Self::splat(factor), addend)
    }

    /// The scalar product of three lanes with one vector, and `addend`.
    #[inline(always)]
    pub fn dot_add([x, y, z]: [Self; 3], [a, b, c]: [T; 3], addend: Self) -> Self {
        x.scale_add(a, y.scale_add(b, z.scale_add(c, addend)))
    }

    /// Three lanes, each moved along its axis.
    #[inline(always)]
    pub fn moved([x, y, z]: [Self; 3], [a, b, c]: [T; 3]) -> [Self; 3] {
        [x + a, y + b, z + c]
    }

    #[inline(always)]
    pub fn square(self) -> Self {
        self * self
    }

    /// Whether so few bytes go through at once that the processor's own root and division, which are slow, come out while it does the
    /// rest.
    const OWN_ROOTS: bool = W * size_of::<T>() < 256;

    /// The square root and one over it, of numbers above zero.
    #[inline(always)]
    pub fn root_and_reciprocal(self) -> (Self, Self) {
        if Self::OWN_ROOTS {
            let root = self.map(T::root);
            (root, Self::splat(T::ONE) / root)
        } else {
            let reciprocal = self.reciprocal_root();
            (self * reciprocal, reciprocal)
        }
    }

    /// One over the square root; large, but finite, at zero.
    ///
    /// Halving the bits of a number, exponent and all, about halves its logarithm: that is a first guess, right to 3.5 %.
    /// Each step of Halley's kind takes an error e to 5/2 e³, the last one of Newton's to 3/2 e²: 1e-4, 2.4e-12, 1e-23.
    #[inline(always)]
    fn reciprocal_root(self) -> Self {
        let one = Self::splat(T::ONE);
        let half = Self::splat(T::of(0.5));
        let mut root = self.map(T::reciprocal_root_guess);
        for _ in 0..T::HALLEY_STEPS {
            let left = (self * root).mul_sub_from(root, one);
            root = (root * left).mul_add(left.scale_add(T::of(0.375), half), root);
        }
        let left = (self * root).mul_sub_from(root, one);
        (root * left).mul_add(half, root)
    }

    /// The square root, by way of [`Lanes::reciprocal_root`].
    #[inline(always)]
    pub fn root(self) -> Self {
        if Self::OWN_ROOTS { self.map(T::root) } else { self * self.reciprocal_root() }
    }

    /// `self` where `condition` holds of the other, zero elsewhere.
    #[inline(always)]
    pub fn only_where(mut self, other: Self, condition: impl Fn(T) -> bool) -> Self {
        for lane in 0..W {
            self.0[lane] = if condition(other.0[lane]) { self.0[lane] } else { T::ZERO };
        }
        self
    }

    /// A polynomial, constant term first (Horner's rule); zero without any term.
    #[inline(always)]
    pub fn polynomial(self, coefficients: &[T]) -> Self {
        let Some(highest) = coefficients.len().checked_sub(1) else { return Self::zero() };
        let mut sum = Self::splat(coefficients[highest]);
        for n in (0..highest).rev() {
            sum = sum.mul_add(self, Self::splat(coefficients[n]));
        }
        sum
    }

    /// Cosine and sine of an angle given in half turns, below 2^20 of them.
    ///
    /// What is left of the angle beyond the nearest whole number of half turns lies within a quarter turn, where two short
    /// polynomials do; an odd number of half turns changes both signs.
    #[inline(always)]
    pub fn cos_sin_half_turns(self) -> (Self, Self) {
        let rounded = self.map(|half_turns| half_turns + T::ROUNDER);
        let rest = self - rounded.map(|rounded| rounded - T::ROUNDER);
        let square = rest.square();
        let mut cosine = square.polynomial(T::COSINE);
        let mut sine = square.polynomial(T::SINE) * rest;
        for lane in 0..W {
            cosine.0[lane] = cosine.0[lane].negated_if_odd(rounded.0[lane]);
            sine.0[lane] = sine.0[lane].negated_if_odd(rounded.0[lane]);
        }
        (cosine, sine)
    }

    /// e to the power of each number; far below zero it gives zero's neighbourhood, beyond the largest number it must not
    /// be used.
    #[inline(always)]
    pub fn exp(self) -> Self {
        let clamped = self.map(|value| if value < T::LEAST_POWER { T::LEAST_POWER } else { value });
        let power = clamped.map(|value| (value * T::LOG2_E + T::ROUNDER) - T::ROUNDER);
        // ln 2 in two parts, so that the remainder keeps its last digits.
        let rest = power.scale_add(T::MINUS_LN_2[1], power.scale_add(T::MINUS_LN_2[0], clamped));
        rest.polynomial(T::EXPONENTIAL) * power.map(T::two_to)
    }

    /// The natural logarithm of each number; for normal numbers above zero.
    ///
    /// The number is taken apart into 2^e m with m within a factor √2 of 1, and ln m = 2 artanh((m-1)/(m+1)), whose series
    /// falls by 34 a term.
    #[inline(always)]
    pub fn ln(self) -> Self {
        let exponent = self.map(T::exponent);
        let mut mantissa = self;
        for lane in 0..W {
            mantissa.0[lane] = self.0[lane] * (T::ZERO - exponent.0[lane]).two_to();
        }
        let s = (mantissa - T::ONE) / (mantissa + T::ONE);
        let tail = s.square().polynomial(T::ARTANH) * s;
        exponent.scale_add(T::LN_2, tail)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Plain = Lanes<f64, 8, false>;
    type Fused = Lanes<f64, 8, true>;
    type Single = Lanes<f32, 16, true>;

    proptest! {
        #[test]
        fn cosine_and_sine_agree_with_the_library(half_turns in -5e3..5e3f64) {
            let angle = std::f64::consts::PI * (half_turns - 2.0 * (0.5 * half_turns).round());
            let (cosine, sine) = Plain::splat(half_turns).cos_sin_half_turns();
            prop_assert!((cosine.0[0] - angle.cos()).abs() < 4e-15, "{} {}", cosine.0[0], angle.cos());
            prop_assert!((sine.0[3] - angle.sin()).abs() < 4e-15, "{} {}", sine.0[3], angle.sin());
            let fused = Fused::splat(half_turns).cos_sin_half_turns();
            prop_assert!((fused.0.0[7] - angle.cos()).abs() < 4e-15);
        }

        #[test]
        fn in_single_precision_cosine_and_sine_agree_to_its_last_digits(half_turns in -60.0..60.0f32) {
            let (cosine, sine) = Single::splat(half_turns).cos_sin_half_turns();
            let angle = std::f64::consts::PI * f64::from(half_turns);
            prop_assert!((f64::from(cosine.0[0]) - angle.cos()).abs() < 4e-7);
            prop_assert!((f64::from(sine.0[15]) - angle.sin()).abs() < 4e-7);
        }

        #[test]
        fn roots_agree_with_the_library(power in -60.0..60.0f64) {
            let x = power.exp2();
            for ours in [Plain::splat(x).reciprocal_root().0[1], Fused::splat(x).reciprocal_root().0[6]] {
                prop_assert!((ours * x.sqrt() - 1.0).abs() < 5e-16, "{}", ours * x.sqrt() - 1.0);
            }
            let (own, stepped) = (Fused::splat(x), Lanes::<f64, 32, true>::splat(x));
            let (own, stepped) = (own.root_and_reciprocal(), stepped.root_and_reciprocal());
            for (root, reciprocal) in [(own.0.0[5], own.1.0[5]), (stepped.0.0[31], stepped.1.0[31])] {
                prop_assert!((root / x.sqrt() - 1.0).abs() < 5e-16);
                prop_assert!((reciprocal * x.sqrt() - 1.0).abs() < 5e-16);
            }
            let single = Lanes::<f32, 64, true>::splat(x as f32).root_and_reciprocal();
            let root = f64::from(x as f32).sqrt();
            prop_assert!((f64::from(single.0.0[9]) / root - 1.0).abs() < 3e-7);
            prop_assert!((f64::from(single.1.0[63]) * root - 1.0).abs() < 3e-7);
        }

        #[test]
        fn the_exponential_agrees_with_the_library(x in -700.0..700.0f64) {
            prop_assert!((Plain::splat(x).exp().0[0] / x.exp() - 1.0).abs() < 5e-15);
            prop_assert!((Fused::splat(x).exp().0[0] / x.exp() - 1.0).abs() < 5e-15);
            let x = x / 10.0;
            let single = f64::from(Single::splat(x as f32).exp().0[0]);
            prop_assert!((single / f64::from(x as f32).exp() - 1.0).abs() < 3e-7);
        }

        #[test]
        fn the_logarithm_agrees_with_the_library(power in -60.0..60.0f64) {
            let x = power.exp2();
            prop_assert!((Plain::splat(x).ln().0[0] - x.ln()).abs() < 5e-15 * (1.0 + power.abs()));
            prop_assert!((Fused::splat(x).ln().0[3] - x.ln()).abs() < 5e-15 * (1.0 + power.abs()));
            let single = f64::from(Single::splat(x as f32).ln().0[3]);
            prop_assert!((single - f64::from(x as f32).ln()).abs() < 2e-7 * (1.0 + power.abs()));
        }
    }

    #[test]
    fn half_turns_and_quarter_turns_are_exact_in_sign() {
        for (half_turns, cosine) in
            [(0.0, 1.0), (1.0, -1.0), (2.0, 1.0), (-1.0, -1.0), (3.0, -1.0), (-4.0, 1.0)]
        {
            let ours = Plain::splat(half_turns).cos_sin_half_turns().0.0[0];
            assert!((ours - cosine).abs() < 3e-15, "{half_turns}: {ours}");
        }
    }

    #[test]
    fn the_root_of_nothing_is_nothing() {
        assert_eq!((Fused::zero().root().0[0], Single::zero().root().0[0]), (0.0, 0.0));
    }

    #[test]
    fn far_below_zero_the_exponential_vanishes() {
        assert!(Plain::splat(-1e9).exp().0[0] < 1e-300);
        assert!(Single::splat(-1e9).exp().0[0] < 1e-36);
    }
}
