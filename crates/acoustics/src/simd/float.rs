//! The two precisions of the field kernel and the constants of its arithmetic in each.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Registers, Vector};

/// `f32` or `f64`.
pub(crate) trait Float:
    Copy
    + Send
    + Sync
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// An instruction set's vector of such numbers.
    type In<R: Registers>: Vector<Self>;

    const ZERO: Self;
    const ONE: Self;
    /// 1.5 times two to the power of the mantissa's bits. Adding and subtracting it rounds a small number to the nearest whole number
    /// (ties to even) with every instruction set, because the sum has no bits for a fraction.
    const ROUNDER: Self;
    /// Negligible beside any squared distance, but with a nonzero square root.
    const TINY: Self;
    /// cos(πr) and sin(πr)/r in powers of r², for |r| up to 0.5: minimax polynomials with errors of 2e-15 and 4e-16 in double
    /// precision, 5e-8 and 1.4e-8 in single.
    const COSINE: &'static [Self];
    const SINE: &'static [Self];
    /// e^x for |x| up to ln(2)/2, likewise (3e-18 and 2e-9).
    const EXPONENTIAL: &'static [Self];
    /// 2/(2n+1): twice the series of artanh(s)/s in powers of s², as many terms as |s| < 0.172 needs.
    const ARTANH: &'static [Self];
    /// -ln 2 as a sum: its leading digits and the remainder.
    const MINUS_LN_2: [Self; 2];
    const LN_2: Self;
    const LOG2_E: Self;
    /// The smallest power of e that is a normal number.
    const LEAST_POWER: Self;
    /// Whether the excess path needs a correction because the precision is too low for differences of whole lengths.
    const REFINED: bool;

    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn fused(self, factor: Self, addend: Self) -> Self;
    /// The square root.
    fn root(self) -> Self;

    /// `-self` if the whole number that was added to [`Float::ROUNDER`] is odd.
    fn negated_if_odd(self, rounded: Self) -> Self;
    /// Two to the power of a whole number.
    fn two_to(self) -> Self;
    /// The whole e for which `self / 2^e` lies within a factor √2 of 1.
    fn exponent(self) -> Self;
    /// The number without its fraction as an index; zero for negative numbers.
    fn index(self) -> usize;
}

macro_rules! real {
    ($float:ident, $of:ident, $bits:ident, $int:ident, $mantissa:literal, $bias:literal, {$($constants:tt)*}) => {
        impl Float for $float {
            type In<R: Registers> = R::$of;

            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const ROUNDER: Self = 1.5 * (1u64 << $mantissa) as Self;
            const TINY: Self = $float::MIN_POSITIVE;
            const LN_2: Self = std::$float::consts::LN_2;
            const LOG2_E: Self = std::$float::consts::LOG2_E;
            $($constants)*

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn fused(self, factor: Self, addend: Self) -> Self {
                self.mul_add(factor, addend)
            }

            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn negated_if_odd(self, rounded: Self) -> Self {
                Self::from_bits(self.to_bits() ^ (rounded.to_bits() << ($bits::BITS - 1)))
            }

            #[inline(always)]
            fn two_to(self) -> Self {
                // The biased exponent, which is in the lowest bits after the rounder is added, is shifted to its position.
                Self::from_bits((self + (Self::ROUNDER + $bias)).to_bits() << $mantissa)
            }

            #[inline(always)]
            fn exponent(self) -> Self {
                let from_root = Self::ONE.to_bits() - std::$float::consts::FRAC_1_SQRT_2.to_bits();
                let above = (self.to_bits() + from_root) >> $mantissa;
                above as $int as Self - $bias
            }

            #[inline(always)]
            fn index(self) -> usize {
                self as usize
            }
        }
    };
}

real!(f64, Double, u64, i64, 52, 1023.0, {
    const COSINE: &'static [Self] = &[
        0.999_999_999_999_998_1,
        -4.934_802_200_543_686,
        4.058_712_126_333_295,
        -1.335_262_766_181_763_5,
        0.235_330_588_313_178_73,
        -0.025_806_531_975_921_562,
        0.001_927_870_052_698_133_3,
        -0.000_100_416_464_220_538_9,
    ];
    const SINE: &'static [Self] = &[
        std::f64::consts::PI,
        -5.167_712_780_049_786,
        2.550_164_039_861_868,
        -0.599_264_528_825_224,
        0.082_145_878_816_310_43,
        -0.007_370_364_326_530_416,
        0.000_465_987_015_804_337_8,
        -2.113_362_735_205_297e-5,
    ];
    const EXPONENTIAL: &'static [Self] = &[
        1.0,
        1.0,
        0.500_000_000_000_001_9,
        0.166_666_666_666_666_8,
        0.041_666_666_666_488_1,
        0.008_333_333_333_319_601,
        0.001_388_888_895_231_477_5,
        0.000_198_412_698_900_471_13,
        2.480_148_548_232_849_4e-5,
        2.755_724_091_857_897e-6,
        2.763_263_964_103_904e-7,
        2.511_003_760_596_377_7e-8,
    ];
    const ARTANH: &'static [Self] = &[
        2.0,
        2.0 / 3.0,
        2.0 / 5.0,
        2.0 / 7.0,
        2.0 / 9.0,
        2.0 / 11.0,
        2.0 / 13.0,
        2.0 / 15.0,
        2.0 / 17.0,
        2.0 / 19.0,
        2.0 / 21.0,
    ];
    const MINUS_LN_2: [Self; 2] = [-0.693_147_180_369_123_8, -1.908_214_929_270_587_7e-10];
    const LEAST_POWER: Self = -708.0;
    const REFINED: bool = false;
});

real!(f32, Single, u32, i32, 23, 127.0, {
    const COSINE: &'static [Self] =
        &[0.999_999_95, -4.934_793, 4.058_410_6, -1.331_873, 0.219_682_42];
    const SINE: &'static [Self] =
        &[std::f32::consts::PI, -5.167_71, 2.550_077_4, -0.598_290_4, 0.077_655_91];
    const EXPONENTIAL: &'static [Self] =
        &[1.0, 1.0, 0.5, 0.166_664_15, 0.041_666_35, 0.008_375_126, 0.001_394_110_8];
    const ARTANH: &'static [Self] = &[2.0, 2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0, 2.0 / 9.0];
    const MINUS_LN_2: [Self; 2] = [-0.693_359_4, 2.121_944_4e-4];
    const LEAST_POWER: Self = -87.0;
    const REFINED: bool = true;
});
