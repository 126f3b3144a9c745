//! The vectors of AVX2 and of AVX-512.

use std::arch::x86_64::*;

use super::vector::{Registers, Vector};
use crate::simd::float::Float;

/// AVX2 and FMA: 32 bytes.
pub(crate) struct Avx2;

impl Registers for Avx2 {
    type Double = Avx2Double;
    type Single = Avx2Single;
}

/// AVX-512: 64 bytes.
pub(crate) struct Avx512;

impl Registers for Avx512 {
    type Double = Avx512Double;
    type Single = Avx512Single;
}

/// A vector and the instructions that it goes through.
macro_rules! vector {
    (
        $(#[$doc:meta])*
        $name:ident, $vector:ident of $lanes:literal $float:ident, mantissa $mantissa:literal, sign $sign:literal,
        splat $splat:ident, load $load:ident, store $store:ident,
        bits $to_bits:ident $from_bits:ident $splat_bits:ident $add_bits:ident $left:ident $right:ident,
        xor $xor:ident,
        above |$value:ident, $other:ident, $limit:ident| $above:expr,
        {$($method:ident($($argument:ident),*) = $instruction:ident;)*}
        $($more:item)*
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $name($vector);

        // SAFETY, for all unsafe operations here: a vector of this kind is only made by work that `InstructionSet::run` does on
        // processors that have the set; and loads and stores are of arrays of the vector's length.
        impl Vector<$float> for $name {
            const LANES: usize = $lanes;

            #[inline(always)]
            fn splat(value: $float) -> Self {
                Self(unsafe { $splat(value) })
            }

            #[inline(always)]
            fn load(from: &[$float]) -> Self {
                let from: &[$float; $lanes] = from.first_chunk().expect("enough numbers");
                Self(unsafe { $load(from.as_ptr()) })
            }

            #[inline(always)]
            fn store(self, to: &mut [$float]) {
                let to: &mut [$float; $lanes] = to.first_chunk_mut().expect("room enough");
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }

            $(
                #[inline(always)]
                fn $method(self $(, $argument: Self)*) -> Self {
                    Self(unsafe { $instruction(self.0 $(, $argument.0)*) })
                }
            )*

            #[inline(always)]
            fn only_where_above(self, other: Self, limit: Self) -> Self {
                let ($value, $other, $limit) = (self.0, other.0, limit.0);
                Self(unsafe { $above })
            }

            #[inline(always)]
            fn negated_if_odd(self, rounded: Self) -> Self {
                Self(unsafe { $xor(self.0, $from_bits($left::<$sign>($to_bits(rounded.0)))) })
            }

            #[inline(always)]
            fn two_to(self) -> Self {
                // The biased exponent, which is in the lowest bits after the rounder is added, is shifted to its position.
                let bias = ($float::MAX_EXP - 1) as $float;
                let biased = self.add(Self::splat($float::ROUNDER + bias));
                Self(unsafe { $from_bits($left::<$mantissa>($to_bits(biased.0))) })
            }

            #[inline(always)]
            fn exponent(self) -> Self {
                // The biased exponent is shifted to the lowest bits of a number whose last fraction bit is worth one.
                let from_root = $float::ONE.to_bits() - std::$float::consts::FRAC_1_SQRT_2.to_bits();
                let whole = Self::splat((1u64 << $mantissa) as $float);
                let above = Self(unsafe {
                    let raised = $add_bits($to_bits(self.0), $splat_bits(from_root as _));
                    $from_bits($add_bits($right::<$mantissa>(raised), $to_bits(whole.0)))
                });
                above.sub(whole).sub(Self::splat(($float::MAX_EXP - 1) as $float))
            }

            $($more)*
        }
    };
}

vector! {
    /// Four numbers in AVX2.
    Avx2Double, __m256d of 4 f64, mantissa 52, sign 63,
    splat _mm256_set1_pd, load _mm256_loadu_pd, store _mm256_storeu_pd,
    bits _mm256_castpd_si256 _mm256_castsi256_pd _mm256_set1_epi64x _mm256_add_epi64 _mm256_slli_epi64 _mm256_srli_epi64,
    xor _mm256_xor_pd,
    above |value, other, limit| _mm256_and_pd(value, _mm256_cmp_pd::<_CMP_GT_OQ>(other, limit)),
    {
        add(other) = _mm256_add_pd;
        sub(other) = _mm256_sub_pd;
        mul(other) = _mm256_mul_pd;
        div(other) = _mm256_div_pd;
        mul_add(factor, addend) = _mm256_fmadd_pd;
        mul_sub_from(factor, from) = _mm256_fnmadd_pd;
        root() = _mm256_sqrt_pd;
        lesser(other) = _mm256_min_pd;
        greater(other) = _mm256_max_pd;
    }
}

vector! {
    /// Eight numbers in AVX2.
    Avx2Single, __m256 of 8 f32, mantissa 23, sign 31,
    splat _mm256_set1_ps, load _mm256_loadu_ps, store _mm256_storeu_ps,
    bits _mm256_castps_si256 _mm256_castsi256_ps _mm256_set1_epi32 _mm256_add_epi32 _mm256_slli_epi32 _mm256_srli_epi32,
    xor _mm256_xor_ps,
    above |value, other, limit| _mm256_and_ps(value, _mm256_cmp_ps::<_CMP_GT_OQ>(other, limit)),
    {
        add(other) = _mm256_add_ps;
        sub(other) = _mm256_sub_ps;
        mul(other) = _mm256_mul_ps;
        div(other) = _mm256_div_ps;
        mul_add(factor, addend) = _mm256_fmadd_ps;
        mul_sub_from(factor, from) = _mm256_fnmadd_ps;
        root() = _mm256_sqrt_ps;
        lesser(other) = _mm256_min_ps;
        greater(other) = _mm256_max_ps;
    }
}

vector! {
    /// Eight numbers in AVX-512.
    Avx512Double, __m512d of 8 f64, mantissa 52, sign 63,
    splat _mm512_set1_pd, load _mm512_loadu_pd, store _mm512_storeu_pd,
    bits _mm512_castpd_si512 _mm512_castsi512_pd _mm512_set1_epi64 _mm512_add_epi64 _mm512_slli_epi64 _mm512_srli_epi64,
    xor _mm512_xor_pd,
    above |value, other, limit| _mm512_maskz_mov_pd(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(other, limit), value),
    {
        add(other) = _mm512_add_pd;
        sub(other) = _mm512_sub_pd;
        mul(other) = _mm512_mul_pd;
        div(other) = _mm512_div_pd;
        mul_add(factor, addend) = _mm512_fmadd_pd;
        mul_sub_from(factor, from) = _mm512_fnmadd_pd;
        lesser(other) = _mm512_min_pd;
        greater(other) = _mm512_max_pd;
    }

    const MANY_REGISTERS: bool = true;
    const SLOW_ROOTS: bool = false;

    /// From the processor's estimate g, accurate to 2^-14: with l = 1 - x g², the root of 1/x is g (1 + l/2 + 3/8 l² + 5/16 l³), to
    /// 6e-17.
    #[inline(always)]
    fn root_and_reciprocals(self) -> [Self; 3] {
        // SAFETY: as for all operations.
        let guess = Self(unsafe { _mm512_rsqrt14_pd(self.0) });
        let left = self.mul(guess).mul_sub_from(guess, Self::splat(1.0));
        let series = left.mul_add(Self::splat(0.3125), Self::splat(0.375));
        let series = left.mul_add(series, Self::splat(0.5));
        let reciprocal = guess.mul(left).mul_add(series, guess);
        [self.mul(reciprocal), reciprocal, reciprocal.mul(reciprocal)]
    }

    #[inline(always)]
    fn root(self) -> Self {
        let [_, reciprocal, _] = self.greater(Self::splat(f64::TINY)).root_and_reciprocals();
        self.mul(reciprocal)
    }
}

vector! {
    /// Sixteen numbers in AVX-512.
    Avx512Single, __m512 of 16 f32, mantissa 23, sign 31,
    splat _mm512_set1_ps, load _mm512_loadu_ps, store _mm512_storeu_ps,
    bits _mm512_castps_si512 _mm512_castsi512_ps _mm512_set1_epi32 _mm512_add_epi32 _mm512_slli_epi32 _mm512_srli_epi32,
    xor _mm512_xor_ps,
    above |value, other, limit| _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(other, limit), value),
    {
        add(other) = _mm512_add_ps;
        sub(other) = _mm512_sub_ps;
        mul(other) = _mm512_mul_ps;
        div(other) = _mm512_div_ps;
        mul_add(factor, addend) = _mm512_fmadd_ps;
        mul_sub_from(factor, from) = _mm512_fnmadd_ps;
        lesser(other) = _mm512_min_ps;
        greater(other) = _mm512_max_ps;
    }

    const MANY_REGISTERS: bool = true;
    const SLOW_ROOTS: bool = false;

    /// From the processor's estimate g, accurate to 2^-14: with l = 1 - x g², the root of 1/x is g (1 + l/2), to 6e-9.
    #[inline(always)]
    fn root_and_reciprocals(self) -> [Self; 3] {
        // SAFETY: as for all operations.
        let guess = Self(unsafe { _mm512_rsqrt14_ps(self.0) });
        let left = self.mul(guess).mul_sub_from(guess, Self::splat(1.0));
        let reciprocal = guess.mul(left).mul_add(Self::splat(0.5), guess);
        [self.mul(reciprocal), reciprocal, reciprocal.mul(reciprocal)]
    }

    #[inline(always)]
    fn root(self) -> Self {
        let [_, reciprocal, _] = self.greater(Self::splat(f32::TINY)).root_and_reciprocals();
        self.mul(reciprocal)
    }
}
