//! The field and its usual derivatives in the usual case (`FieldKernel::is_usual`), with the fewest operations.
//!
//! With the lobe D(v), v = sin² θ = (x² + y²)/d², and the magnitude m = a D/d: dm/dx = x (q + g), dm/dy = y (q + g) and dm/dz = z q,
//! where g = 2 a D'/d³ and q = -m/d² - g v. The phase changes by k x/d, k y/d and k z/d.

use super::derivative_sums::{AT_ONCE, DerivativeSums};
use super::phasor::Phasor;
use super::ray::{Ray, excess};
use super::surroundings::Near;
use crate::lobe::Lobe;
use crate::simd::float::Float;
use crate::simd::{Simd, Vector};

/// What the sums depend on besides sources and points.
pub(super) struct UsualDerivatives<'k, T> {
    /// Lobes of the sources, one for each radius.
    pub lobes: &'k [Lobe<T>],
    pub half_turns_per_m: T,
    pub wavenumber_rad_m: T,
}

/// exp(i φ) without its sign, and what gives the sign.
#[derive(Clone, Copy)]
struct Wave<T, V, const L: usize> {
    phase: Phasor<T, V, L>,
    odd: Simd<T, V, L>,
}

impl<T: Float> UsualDerivatives<'_, T> {
    /// The wave at the ends of a source's rays.
    #[inline(always)]
    fn wave<V: Vector<T>, const L: usize>(
        &self,
        source: &Near<T>,
        step: [Simd<T, V, L>; 3],
        ray: &Ray<T, V, L>,
    ) -> Wave<T, V, L> {
        let sum_of_ends = Simd::moved(ray.along, source.offset);
        let half_turns = excess(source, step, ray.distance, ray.inverse, sum_of_ends)
            .scale_add(self.half_turns_per_m, Simd::splat(source.half_turns));
        let [cosine, sine, odd] = half_turns.cos_sin_half_turns();
        Wave { phase: Phasor([cosine, sine]), odd }
    }

    /// The field and its derivatives at points that lie `step` from the tile's middle.
    #[inline(always)]
    pub fn sum<V: Vector<T>, const L: usize>(
        &self,
        near: &[Near<T>],
        step: [Simd<T, V, L>; 3],
    ) -> ([Simd<T, V, L>; 2], DerivativeSums<T, V, L>) {
        let zero = Phasor([Simd::zero(); 2]);
        let (mut sum, mut derivatives) = (zero, [zero; AT_ONCE]);
        if let Some(first) = near.first() {
            let mut ray = Ray::new(first, step);
            let mut wave = self.wave(first, step, &ray);
            for (n, source) in near.iter().enumerate() {
                // Each operation from a place to a phase waits for the one before. The processor does those of the next source while
                // it adds this one, as far as there are registers to keep them.
                let after = near.get(n + 1).unwrap_or(source);
                let ray_after = Ray::new(after, step);
                let wave_after;
                if V::MANY_REGISTERS {
                    wave_after = self.wave(after, step, &ray_after);
                } else {
                    wave = self.wave(source, step, &ray);
                    wave_after = wave;
                }
                let Wave { phase, odd } = wave;

                let [x, y, z] = ray.along;
                let variable = ray.across_square * ray.inverse_square;
                let [directivity, slope] = self.lobes[source.lobe].smooth_with_slope(variable);
                let level = ray.inverse * source.amplitude;
                let level = level.only_where_above(z, T::ZERO).negated_if_odd(odd);

                let field = phase.scaled(level * directivity);
                let by_sine = phase.scaled(level * (slope + slope));
                let by_wavelength = by_sine.scaled(Simd::zero() - variable);
                let turned = field.turned().scaled(ray.distance * self.wavenumber_rad_m);
                let upwards = (by_wavelength + turned - field).scaled(ray.inverse_square);
                let across = upwards.plus(by_sine, ray.inverse_square);

                sum = sum + field;
                let [by_x, by_y, by_z, by_speed] = derivatives;
                derivatives = [
                    by_x.plus(across, x),
                    by_y.plus(across, y),
                    by_z.plus(upwards, z),
                    by_speed + (by_wavelength - turned),
                ];
                (ray, wave) = (ray_after, wave_after);
            }
        }
        (sum.0, derivatives.map(|Phasor(parts)| parts))
    }
}
