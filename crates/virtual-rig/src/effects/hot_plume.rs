//! A plume of warm air in the field: sound travels faster through it, so it refracts the beam as a lens does.
//!
//! The excess of the sound speed is a Gaussian ball, whose integral along a straight path is an error function.

use std::f64::consts::FRAC_2_SQRT_PI;

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite, Positive};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HotPlume {
    centre_mm: Exact<Finite, 3>,
    /// Radius at which the excess has fallen to 1/e.
    radius_mm: Positive,
    /// Excess of the sound speed at the centre, relative.
    excess: Finite,
}

impl Effect for HotPlume {
    fn path(&self, path: &mut Path) {
        let direction = path.direction();
        let radius_m = self.radius_mm.get() * 1e-3;
        let from_m = path.from_m - Vec3::from(self.centre_mm.map(|mm| mm.get() * 1e-3));
        let along_m = from_m.dot(&direction);
        let miss_m = (from_m - along_m * direction).norm();
        let edge = |s_m: f64| libm::erf(s_m / radius_m);
        // ∫ exp(-s²/r²) ds = r √π/2 erf(s/r), and √π/2 is one over FRAC_2_SQRT_PI.
        let through_m = radius_m / FRAC_2_SQRT_PI
            * (-(miss_m / radius_m).powi(2)).exp()
            * (edge(along_m + path.distance_m()) - edge(along_m));
        path.time_s -= self.excess.get() * through_m / path.speed_m_s;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_time_gained_is_the_integral_of_the_excess_along_the_path() {
        let plume: HotPlume =
            effect("centre_mm = [5.0, -3.0, 50.0]\nradius_mm = 12.0\nexcess = 0.02");
        let centre_m = Vec3::new(5e-3, -3e-3, 50e-3);
        let (from, to) = (Vec3::new(-0.02, 0.01, 0.0), Vec3::new(0.03, -0.01, 0.12));
        let mut path = Path::straight(0, from, to, 343.0);
        plume.path(&mut path);
        let steps = 20_000;
        let excess: f64 = (0..steps)
            .map(|i| {
                let at = from.lerp(&to, (f64::from(i) + 0.5) / f64::from(steps));
                0.02 * (-((at - centre_m).norm() / 12e-3).powi(2)).exp()
            })
            .sum::<f64>()
            / f64::from(steps);
        let length_m = (to - from).norm();
        let gained_s = length_m / 343.0 - path.time_s;
        assert!((gained_s / (excess * length_m / 343.0) - 1.0).abs() < 1e-6);
    }
}
