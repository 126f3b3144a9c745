//! Eight numbers at a time, without branches, so that the compiler turns each operation into vector
//! instructions of whatever width the processor has.
//!
//! `FUSED` says whether the processor multiplies and adds in one instruction; where it does not, `mul_add`
//! would be a library call many times slower than the two operations.

/// Numbers in one bundle.
pub(super) const WIDTH: usize = 8;

/// Eight numbers that go through the same arithmetic.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes(pub [f64; WIDTH]);

/// Adding and taking away 1.5 * 2^52 rounds a number below 2^51 to the nearest whole one (ties to even), on every
/// instruction set, because no fraction fits beside it.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

macro_rules! lanewise {
    ($($name:ident: $op:tt),*) => {$(
        #[inline(always)]
        pub(super) fn $name(self, other: Self) -> Self {
            let mut out = self;
            for lane in 0..WIDTH {
                out.0[lane] = self.0[lane] $op other.0[lane];
            }
            out
        }
    )*};
}

impl Lanes {
    lanewise!(add: +, sub: -, mul: *, div: /);

    #[inline(always)]
    pub(super) fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for lane in 0..WIDTH {
            out.0[lane] = f(self.0[lane]);
        }
        out
    }

    /// `self * factor + addend`.
    #[inline(always)]
    pub(super) fn mul_add<const FUSED: bool>(self, factor: Self, addend: Self) -> Self {
        let mut out = self;
        for lane in 0..WIDTH {
            out.0[lane] = if FUSED {
                self.0[lane].mul_add(factor.0[lane], addend.0[lane])
            } else {
                self.0[lane] * factor.0[lane] + addend.0[lane]
            };
        }
        out
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    /// The nearest whole number; for numbers below 2^51.
    #[inline(always)]
    pub(super) fn round(self) -> Self {
        self.map(|value| (value + ROUNDER) - ROUNDER)
    }

    /// A polynomial, constant term first (Horner's rule).
    #[inline(always)]
    pub(super) fn polynomial<const FUSED: bool>(self, coefficients: &[f64]) -> Self {
        let mut sum = Self::splat(0.0);
        for &coefficient in coefficients.iter().rev() {
            sum = sum.mul_add::<FUSED>(self, Self::splat(coefficient));
        }
        sum
    }

    /// Cosine and sine of an angle given in whole turns.
    ///
    /// The angle is brought within a quarter turn of a half-turn multiple, where the Taylor series to the 23rd power
    /// are right to the last digits; an odd number of half turns changes both signs.
    #[inline(always)]
    pub(super) fn cos_sin_turns<const FUSED: bool>(self) -> (Self, Self) {
        let half_turns = self.add(self).round();
        let rest = self.sub(half_turns.mul(Self::splat(0.5)));
        let pairs = half_turns.mul(Self::splat(0.5)).sub(Self::splat(0.25)).round();
        let odd = half_turns.sub(pairs.add(pairs));
        let sign = Self::splat(1.0).sub(odd.add(odd));
        let angle = rest.mul(Self::splat(std::f64::consts::TAU));
        let square = angle.mul(angle);
        let cosine = square.polynomial::<FUSED>(&COSINE).mul(sign);
        let sine = square.polynomial::<FUSED>(&SINE).mul(angle).mul(sign);
        (cosine, sine)
    }

    /// e to the power of each number; below -708 it gives zero's neighbourhood, above 709 it must not be used.
    #[inline(always)]
    pub(super) fn exp<const FUSED: bool>(self) -> Self {
        let clamped = self.map(|value| if value < -708.0 { -708.0 } else { value });
        let power = clamped.mul(Self::splat(std::f64::consts::LOG2_E)).round();
        // ln 2 in two parts, so that the remainder keeps its last digits.
        let rest = power
            .mul_add::<FUSED>(Self::splat(-6.931_471_803_691_238e-1), clamped)
            .sub(power.mul(Self::splat(1.908_214_929_270_587_7e-10)));
        let two_to_power = power.map(|value| f64::from_bits(((value as i64 + 1023) as u64) << 52));
        rest.polynomial::<FUSED>(&EXPONENTIAL).mul(two_to_power)
    }

    /// The natural logarithm of each number; for normal numbers above zero.
    ///
    /// The number is taken apart into 2^e m with m within a factor √2 of 1, and ln m = 2 artanh((m-1)/(m+1)), whose series
    /// falls by 34 a term.
    #[inline(always)]
    pub(super) fn ln<const FUSED: bool>(self) -> Self {
        let exponent = self.map(|value| {
            let above = (value.to_bits() + (0x3ff0_0000_0000_0000 - SQRT_HALF.to_bits())) >> 52;
            above as i64 as f64 - 1023.0
        });
        let mut mantissa = self;
        for lane in 0..WIDTH {
            let shift = (exponent.0[lane] as i64) << 52;
            mantissa.0[lane] = f64::from_bits((self.0[lane].to_bits() as i64 - shift) as u64);
        }
        let one = Self::splat(1.0);
        let s = mantissa.sub(one).div(mantissa.add(one));
        let square = s.mul(s);
        let tail = square.polynomial::<FUSED>(&ARTANH).mul(s);
        exponent.mul_add::<FUSED>(Self::splat(std::f64::consts::LN_2), tail)
    }
}

const SQRT_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// 2/(2n+1): twice the series of artanh(s)/s in powers of s², enough for |s| < 0.172.
const ARTANH: [f64; 11] = {
    let mut coefficients = [0.0; 11];
    let mut index = 0;
    while index < 11 {
        coefficients[index] = 2.0 / (2 * index + 1) as f64;
        index += 1;
    }
    coefficients
};

/// 1/n! with the signs of the series, in powers of the square.
const COSINE: [f64; 12] = series(0, -1.0, 2);
const SINE: [f64; 12] = series(1, -1.0, 2);
/// 1/n!, enough for |x| < ln(2)/2.
const EXPONENTIAL: [f64; 14] = series(0, 1.0, 1);

/// The Taylor coefficients `sign^i / (start + i * step)!`.
const fn series<const N: usize>(start: usize, sign: f64, step: usize) -> [f64; N] {
    let mut coefficients = [0.0; N];
    let mut coefficient = 1.0;
    let mut power = start;
    let mut index = 0;
    while index < N {
        coefficients[index] = coefficient;
        let mut stepped = 0;
        while stepped < step {
            power += 1;
            coefficient /= power as f64;
            stepped += 1;
        }
        coefficient *= sign;
        index += 1;
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn cosine_and_sine_agree_with_the_library(turns in -5e3..5e3f64) {
            let (cosine, sine) = Lanes::splat(turns).cos_sin_turns::<false>();
            let angle = std::f64::consts::TAU * (turns - turns.round());
            prop_assert!((cosine.0[0] - angle.cos()).abs() < 3e-15, "{} {}", cosine.0[0], angle.cos());
            prop_assert!((sine.0[3] - angle.sin()).abs() < 3e-15, "{} {}", sine.0[3], angle.sin());
            let fused = Lanes::splat(turns).cos_sin_turns::<true>();
            prop_assert!((fused.0.0[7] - angle.cos()).abs() < 3e-15);
        }

        #[test]
        fn the_exponential_agrees_with_the_library(x in -700.0..700.0f64) {
            let ours = Lanes::splat(x).exp::<false>().0[0];
            prop_assert!((ours / x.exp() - 1.0).abs() < 5e-15, "{ours} {}", x.exp());
            prop_assert!((Lanes::splat(x).exp::<true>().0[0] / x.exp() - 1.0).abs() < 5e-15);
        }
    }

    proptest! {
        #[test]
        fn the_logarithm_agrees_with_the_library(power in -60.0..60.0f64) {
            let x = power.exp2();
            prop_assert!((Lanes::splat(x).ln::<false>().0[0] - x.ln()).abs() < 5e-15 * (1.0 + power.abs()));
            prop_assert!((Lanes::splat(x).ln::<true>().0[3] - x.ln()).abs() < 5e-15 * (1.0 + power.abs()));
        }
    }

    #[test]
    fn half_turns_and_quarter_turns_are_exact_in_sign() {
        for (turns, cosine) in
            [(0.0, 1.0), (0.5, -1.0), (1.0, 1.0), (-0.5, -1.0), (1.5, -1.0), (-2.0, 1.0)]
        {
            assert!(
                (Lanes::splat(turns).cos_sin_turns::<false>().0.0[0] - cosine).abs() < 1e-15,
                "{turns}"
            );
        }
    }

    #[test]
    fn far_below_zero_the_exponential_vanishes() {
        assert!(Lanes::splat(-1e9).exp::<false>().0[0] < 1e-300);
    }
}
