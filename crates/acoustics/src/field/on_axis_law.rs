//! How the pressure of a source falls with distance, in one precision.

use crate::simd::float::Float;
use crate::simd::{Simd, Vector};
use crate::transducer::OnAxis;

/// [`OnAxis`] in one precision, without its amplitude.
#[derive(Clone, Copy)]
pub(super) enum OnAxisLaw<T> {
    Spherical,
    Exponential { per_m: T },
    Power { exponent: T },
    Absorbed { np_m: T },
}

impl<T: Float> OnAxisLaw<T> {
    pub fn new(on_axis: OnAxis) -> Self {
        match on_axis {
            OnAxis::Spherical => Self::Spherical,
            OnAxis::Exponential { decay_per_m, .. } => {
                Self::Exponential { per_m: T::of(-decay_per_m) }
            }
            OnAxis::Power { exponent } => Self::Power { exponent: T::of(-exponent) },
            OnAxis::Absorbed { attenuation_np_m, .. } => {
                Self::Absorbed { np_m: T::of(-attenuation_np_m) }
            }
        }
    }

    /// The level at a distance and its inverse, and at a height above the source's face.
    #[inline(always)]
    pub fn level<V: Vector<T>, const L: usize>(
        self,
        distance: Simd<T, V, L>,
        inverse: Simd<T, V, L>,
        height: Simd<T, V, L>,
    ) -> Simd<T, V, L> {
        match self {
            Self::Spherical => inverse,
            Self::Exponential { per_m } => (height * per_m).exp(),
            Self::Power { exponent } => (distance.ln() * exponent).exp(),
            Self::Absorbed { np_m } => (distance * np_m).exp() * inverse,
        }
    }

    /// The relative fall of the level by distance, and its relative change by height.
    #[inline(always)]
    pub fn rates<V: Vector<T>, const L: usize>(self, inverse: Simd<T, V, L>) -> (Simd<T, V, L>, T) {
        match self {
            Self::Spherical => (inverse, T::ZERO),
            Self::Exponential { per_m } => (Simd::zero(), per_m),
            Self::Power { exponent } => (inverse * (T::ZERO - exponent), T::ZERO),
            Self::Absorbed { np_m } => (inverse - np_m, T::ZERO),
        }
    }
}
