//! Which vector instructions the processor has, and the kernel compiled for each.

use super::tile::{Near, Prepared, Sums, sum_tile};
use crate::acoustics::Vec3;
use crate::acoustics::real::Real;

/// A set of vector instructions that the kernel is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// What every processor of the architecture has: SSE2 on x86-64, NEON on AArch64.
    Baseline,
    /// AVX2 and FMA: 32 bytes, multiplying and adding at once.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512: 64 bytes.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    /// All, the best last.
    pub const ALL: &'static [Self] = &[
        Self::Baseline,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
    ];

    /// The best that this processor has.
    pub fn best() -> Self {
        let there = Self::ALL.iter().copied().rfind(|set| set.is_there());
        there.unwrap_or(Self::Baseline)
    }

    /// Whether this processor has it.
    pub fn is_there(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_there()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Sums a tile with these instructions.
    pub(super) fn sum<T: Real, const PLAIN: bool, const N: usize>(
        self,
        prepared: &Prepared<T>,
        near: &[Near<T>],
        points_m: &[Vec3],
        sums: &mut Sums,
    ) {
        match self {
            // NEON multiplies and adds at once; SSE2 does not.
            #[cfg(target_arch = "aarch64")]
            Self::Baseline => sum_tile::<T, 16, true, PLAIN, N>(prepared, near, points_m, sums),
            #[cfg(not(target_arch = "aarch64"))]
            Self::Baseline => sum_tile::<T, 8, false, PLAIN, N>(prepared, near, points_m, sums),
            // SAFETY: a kernel takes an instruction set only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { avx2::<T, PLAIN, N>(prepared, near, points_m, sums) },
            // SAFETY: likewise.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512::<T, PLAIN, N>(prepared, near, points_m, sums) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<T: Real, const PLAIN: bool, const N: usize>(
    prepared: &Prepared<T>,
    near: &[Near<T>],
    points_m: &[Vec3],
    sums: &mut Sums,
) {
    sum_tile::<T, 16, true, PLAIN, N>(prepared, near, points_m, sums);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
fn avx512<T: Real, const PLAIN: bool, const N: usize>(
    prepared: &Prepared<T>,
    near: &[Near<T>],
    points_m: &[Vec3],
    sums: &mut Sums,
) {
    sum_tile::<T, 32, true, PLAIN, N>(prepared, near, points_m, sums);
}
