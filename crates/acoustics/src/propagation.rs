//! The effects of air on propagation besides spreading: wind, a gradient of the speed of sound, attenuation.

use super::Vec3;
use super::simd::float::Float;
use super::simd::{Simd, Vector};

/// Air with wind, a gradient of the speed of sound, or attenuation. The default has none of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Propagation {
    /// Velocity of a steady wind over the speed of sound, along each axis; below 1.
    pub mach: Vec3,
    /// Relative change of the speed of sound per metre, along each axis, from the array's centre.
    pub gradient_per_m: Vec3,
    /// Attenuation of the amplitude, Np/m.
    pub attenuation_np_m: f64,
}

impl Default for Propagation {
    fn default() -> Self {
        Self { mach: Vec3::zeros(), gradient_per_m: Vec3::zeros(), attenuation_np_m: 0.0 }
    }
}

/// The same in one precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Air<T> {
    mach: [T; 3],
    gradient_per_m: [T; 3],
    attenuation_np_m: T,
}

impl<T: Float> Air<T> {
    pub fn new(propagation: &Propagation) -> Self {
        let lanes = |vector: &Vec3| [T::of(vector.x), T::of(vector.y), T::of(vector.z)];
        Self {
            mach: lanes(&propagation.mach),
            gradient_per_m: lanes(&propagation.gradient_per_m),
            attenuation_np_m: T::of(-propagation.attenuation_np_m),
        }
    }

    /// Relative delay compared with still, uniform air, for straight rays `along_m` from one source; `inverse` is one over their
    /// length.
    ///
    /// Wind: the travel time is d/(c + v·n) (Pierce, *Acoustics*, section 8-1, straight rays). Gradient: the mean of 1/(1 + g·x) along
    /// the ray, expanded about the middle of the ray as (1 + δ²/12)/(1 + ε), where δ is the relative change along the ray; the error
    /// is of the fourth order in δ. Together (1 + δ²/12)/((1 + m)(1 + ε)). The result is this minus 1, computed without a difference
    /// of numbers close to 1.
    #[inline(always)]
    pub fn delay<V: Vector<T>, const L: usize>(
        &self,
        from_m: [T; 3],
        along_m: [Simd<T, V, L>; 3],
        inverse: Simd<T, V, L>,
    ) -> Simd<T, V, L> {
        let carried = Simd::dot_add(along_m, self.mach, Simd::zero()) * inverse;
        let change = Simd::dot_add(along_m, self.gradient_per_m, Simd::zero());
        let [gx, gy, gz] = self.gradient_per_m;
        let start = gx * from_m[0] + gy * from_m[1] + gz * from_m[2];
        let faster = change.scale_add(T::of(0.5), Simd::splat(start)).at_least(T::of(-0.9));
        let middle = faster + T::ONE;
        let relative = change / middle;
        let bent = relative.square() * T::of(1.0 / 12.0);
        (bent - carried * middle - faster) / ((carried + T::ONE) * middle)
    }

    /// Amplitude relative to that without attenuation.
    #[inline(always)]
    pub fn transmission<V: Vector<T>, const L: usize>(
        &self,
        distance: Simd<T, V, L>,
    ) -> Simd<T, V, L> {
        (distance * self.attenuation_np_m).exp()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::simd::{Plain, Registers};

    type Double = <Plain<2, 4, false> as Registers>::Double;

    /// Travel time along a ray over that in still, uniform air.
    fn slowness(propagation: &Propagation, from: Vec3, to: Vec3) -> f64 {
        let along = to - from;
        let lanes = [0, 1, 2].map(|axis| Simd::<f64, Double, 4>::splat(along[axis]));
        let inverse = Simd::splat(1.0 / along.norm());
        1.0 + Air::<f64>::new(propagation).delay(from.into(), lanes, inverse).lane(2)
    }

    proptest! {
        #[test]
        fn the_delay_by_a_gradient_is_the_integral_of_slowness_along_the_ray(
            gradient in prop::array::uniform3(-0.4..0.4f64), to in prop::array::uniform3(-0.1..0.1f64),
        ) {
            let gradient_per_m = Vec3::from(gradient);
            let (from, to) = (Vec3::new(0.02, -0.01, 0.0), Vec3::from(to) + Vec3::z() * 0.2);
            let air = Propagation { gradient_per_m, ..Propagation::default() };
            let ours = slowness(&air, from, to);
            let n = 2000;
            let integral: f64 = (0..n)
                .map(|i| from.lerp(&to, (f64::from(i) + 0.5) / f64::from(n)))
                .map(|at| 1.0 / (1.0 + gradient_per_m.dot(&at)) / f64::from(n))
                .sum();
            prop_assert!((ours / integral - 1.0).abs() < 2e-5, "{ours} {integral}");
        }
    }

    #[test]
    fn sound_is_faster_with_the_wind_and_slower_against_it() {
        let air = Propagation { mach: Vec3::new(0.01, 0.0, 0.0), ..Propagation::default() };
        for (to, time) in [(Vec3::x(), 1.0 / 1.01), (-Vec3::x(), 1.0 / 0.99), (Vec3::z(), 1.0)] {
            assert!((slowness(&air, Vec3::zeros(), to) - time).abs() < 1e-14);
        }
    }

    #[test]
    fn one_neper_is_a_factor_of_one_over_e() {
        let air = Propagation { attenuation_np_m: 4.0, ..Propagation::default() };
        let quarter = Simd::<f64, Double, 4>::splat(0.25);
        let left = Air::<f64>::new(&air).transmission(quarter).lane(0);
        assert!((left - (-1f64).exp()).abs() < 1e-15);
    }
}
