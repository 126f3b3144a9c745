//! Which vector instructions the processor has, and code compiled for each.

#[cfg(target_arch = "x86_64")]
use std::hint::black_box;

#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx512};
use crate::simd::{Plain, Registers};

/// A set of vector instructions that the kernel is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// The instructions of every processor of the architecture: SSE2 on x86-64, NEON on AArch64.
    Baseline,
    /// AVX2 and FMA: vectors of 32 bytes, fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512: vectors of 64 bytes.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Work that is compiled once for each instruction set. All functions in it must be `#[inline(always)]`, so that they are compiled
/// with the set enabled.
pub(super) trait Vectorised {
    /// Does the work with an instruction set's vectors, `VECTORS` at a time.
    fn run<R: Registers, const VECTORS: usize>(self);
}

impl InstructionSet {
    /// All sets, the best last.
    pub const ALL: &'static [Self] = &[
        Self::Baseline,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
    ];

    /// The best that this processor has.
    pub fn best() -> Self {
        let there = Self::ALL.iter().copied().rfind(|set| set.is_available());
        there.unwrap_or(Self::Baseline)
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Does work with these instructions. The number of vectors at a time was measured to be the fastest: several, so that the
    /// processor can work on one while it waits for another, but no more than there are registers for.
    pub(super) fn run(self, work: impl Vectorised) {
        match self {
            // NEON has a fused multiply-add; SSE2 has not.
            #[cfg(target_arch = "aarch64")]
            Self::Baseline => work.run::<Plain<4, 8, true>, 4>(),
            #[cfg(not(target_arch = "aarch64"))]
            Self::Baseline => work.run::<Plain<2, 4, false>, 4>(),
            // SAFETY: a kernel takes an instruction set only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { avx2(work) },
            // SAFETY: likewise.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { avx512(work) },
        }
    }
}

/// A value that begins a cache line.
///
/// The compiler keeps vectors on the stack where it has no register left for them, but aligns the stack only for values that it knows of
/// before. Without such a value, half of these vectors lie across two cache lines, and each load or store of them takes twice as long.
#[cfg(target_arch = "x86_64")]
#[repr(align(64))]
struct CacheLine(#[expect(dead_code, reason = "only its place counts")] u8);

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(work: impl Vectorised) {
    black_box(&mut CacheLine(0));
    work.run::<Avx2, 3>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
fn avx512(work: impl Vectorised) {
    black_box(&mut CacheLine(0));
    work.run::<Avx512, 4>();
}
