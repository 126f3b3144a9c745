//! What the air does to sound on its way besides spreading it: it carries it, bends its speed, takes from it.

use super::Vec3;
use super::lanes::Lanes;

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

/// Eight straight ways from one element to eight points.
pub(super) struct Ray {
    pub from_m: [Lanes; 3],
    pub along_m: [Lanes; 3],
    pub inverse: Lanes,
}

impl Propagation {
    /// Travel time over that in still, uniform air.
    ///
    /// Wind: d/(c + v·n) (Pierce, *Acoustics*, section 8-1, straight rays). Gradient: the mean of 1/(1 + g·x) along the way,
    /// which is ln(1 + r)/r over the value at its start, taken about the middle as (1 + δ²/12)/(1 + ε): exact to the
    /// fourth order in the change δ along the way.
    #[inline(always)]
    pub(super) fn slowness<const FUSED: bool>(&self, ray: &Ray) -> Lanes {
        let dot = |vector: &Vec3, lanes: &[Lanes; 3]| {
            lanes[0].mul(Lanes::splat(vector.x)).add(
                lanes[1]
                    .mul_add::<FUSED>(Lanes::splat(vector.y), lanes[2].mul(Lanes::splat(vector.z))),
            )
        };
        let one = Lanes::splat(1.0);
        let carried = dot(&self.mach, &ray.along_m).mul(ray.inverse).add(one);
        let change = dot(&self.gradient_per_m, &ray.along_m);
        let middle = dot(&self.gradient_per_m, &ray.from_m)
            .add(change.mul(Lanes::splat(0.5)))
            .add(one)
            .map(|speed| if speed > 0.1 { speed } else { 0.1 });
        let relative = change.div(middle);
        let bent = relative.mul(relative).mul_add::<FUSED>(Lanes::splat(1.0 / 12.0), one);
        bent.div(carried.mul(middle))
    }

    /// Amplitude over that in clear air.
    #[inline(always)]
    pub(super) fn transmission<const FUSED: bool>(&self, distance: Lanes) -> Lanes {
        distance.mul(Lanes::splat(-self.attenuation_np_m)).exp::<FUSED>()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ray(from: Vec3, to: Vec3) -> Ray {
        let along = to - from;
        let lanes = |v: &Vec3| [0, 1, 2].map(|axis| Lanes::splat(v[axis]));
        Ray {
            from_m: lanes(&from),
            along_m: lanes(&along),
            inverse: Lanes::splat(1.0 / along.norm()),
        }
    }

    proptest! {
        #[test]
        fn a_gradients_time_is_the_integral_of_slowness_along_the_way(
            gradient in prop::array::uniform3(-0.4..0.4f64), to in prop::array::uniform3(-0.1..0.1f64),
        ) {
            let gradient_per_m = Vec3::from(gradient);
            let (from, to) = (Vec3::new(0.02, -0.01, 0.0), Vec3::from(to) + Vec3::z() * 0.2);
            let air = Propagation { gradient_per_m, ..Propagation::default() };
            let ours = air.slowness::<false>(&ray(from, to)).0[0];
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
            assert!((air.slowness::<true>(&ray(Vec3::zeros(), to)).0[2] - time).abs() < 1e-14);
        }
    }

    #[test]
    fn a_neper_leaves_one_part_in_e() {
        let air = Propagation { attenuation_np_m: 4.0, ..Propagation::default() };
        let left = air.transmission::<false>(Lanes::splat(0.25)).0[0];
        assert!((left - (-1f64).exp()).abs() < 1e-15);
    }
}
