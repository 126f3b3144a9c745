//! What the air does to sound on its way besides spreading it: it carries it, bends its speed, takes from it.

use super::Vec3;
use super::float::Float;
use super::simd::{Simd, Vector};

/// Air that is not still, not uniform, or not clear. The default is still, uniform and clear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Propagation {
    /// Steady wind over the speed of sound, along each axis; below 1.
    pub mach: Vec3,
    /// Relative change of the speed of sound a metre, along each axis, about the array's centre.
    pub gradient_per_m: Vec3,
    /// Attenuation of the amplitude, nepers a metre of path.
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

    /// By what share of itself travel time is longer than in still, uniform air, for straight ways `along` from one source;
    /// `inverse` is one over their length.
    ///
    /// Wind: d/(c + v·n) (Pierce, *Acoustics*, section 8-1, straight rays). Gradient: the mean of 1/(1 + g·x) along the way,
    /// which is ln(1 + r)/r over the value at its start, taken about the middle as (1 + δ²/12)/(1 + ε): exact to the
    /// fourth order in the change δ along the way. Together (1 + δ²/12)/((1 + m)(1 + ε)), and what that is more than 1
    /// without a difference of numbers near 1.
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

    /// Amplitude over that in clear air.
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

    /// Travel time along a way over that in still, uniform air.
    fn slowness(propagation: &Propagation, from: Vec3, to: Vec3) -> f64 {
        let along = to - from;
        let lanes = [0, 1, 2].map(|axis| Simd::<f64, Double, 4>::splat(along[axis]));
        let inverse = Simd::splat(1.0 / along.norm());
        1.0 + Air::<f64>::new(propagation).delay(from.into(), lanes, inverse).lane(2)
    }

    proptest! {
        #[test]
        fn a_gradients_time_is_the_integral_of_slowness_along_the_way(
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
    fn a_neper_leaves_one_part_in_e() {
        let air = Propagation { attenuation_np_m: 4.0, ..Propagation::default() };
        let quarter = Simd::<f64, Double, 4>::splat(0.25);
        let left = Air::<f64>::new(&air).transmission(quarter).lane(0);
        assert!((left - (-1f64).exp()).abs() < 1e-15);
    }
}
