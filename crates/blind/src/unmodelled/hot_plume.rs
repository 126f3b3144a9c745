//! A plume of warm air in the field: sound travels faster through it, so it refracts the beam as a lens does.
//!
//! The excess of the sound speed is a Gaussian ball, whose integral along a straight path is an error function.

use std::f64::consts::FRAC_2_SQRT_PI;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::effects::{Effect, Path};

pub(super) const NAME: &str = "hot-plume";

#[derive(Debug, Clone, Copy)]
struct HotPlume {
    centre_m: Vec3,
    /// Radius at which the excess has fallen to 1/e, m.
    radius_m: f64,
    /// Excess of the sound speed at the centre, relative.
    excess: f64,
}

/// Up to 8 % of the sound speed, which is some 45 °C: the air above a soldering iron.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let centre_m = Vec3::new(
        random.uniform(-20e-3, 20e-3),
        random.uniform(-20e-3, 20e-3),
        random.uniform(20e-3, 90e-3),
    );
    let radius_m = random.uniform(10e-3, 20e-3);
    Draw::new(0.08, move |excess| HotPlume { centre_m, radius_m, excess })
}

impl Effect for HotPlume {
    fn path(&self, path: &mut Path) {
        let direction = path.direction();
        let from_m = path.from_m - self.centre_m;
        let along_m = from_m.dot(&direction);
        let miss_m = (from_m - along_m * direction).norm();
        let edge = |s_m: f64| libm::erf(s_m / self.radius_m);
        // ∫ exp(-s²/r²) ds = r √π/2 erf(s/r), and √π/2 is one over FRAC_2_SQRT_PI.
        let through_m = self.radius_m / FRAC_2_SQRT_PI
            * (-(miss_m / self.radius_m).powi(2)).exp()
            * (edge(along_m + path.distance_m()) - edge(along_m));
        path.time_s -= self.excess * through_m / path.speed_m_s;
    }
}

impl Unmodelled for HotPlume {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let at_mm = self.centre_m * 1e3;
        toml::toml! {
            centre_mm = [(at_mm.x), (at_mm.y), (at_mm.z)]
            radius_mm = (self.radius_m * 1e3)
            excess = (self.excess)
        }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_gained_is_the_integral_of_the_excess_along_the_path() {
        let plume =
            HotPlume { centre_m: Vec3::new(5e-3, -3e-3, 50e-3), radius_m: 12e-3, excess: 0.02 };
        let (from, to) = (Vec3::new(-0.02, 0.01, 0.0), Vec3::new(0.03, -0.01, 0.12));
        let mut path = Path::straight(0, from, to, 343.0);
        plume.path(&mut path);
        let steps = 20_000;
        let excess: f64 = (0..steps)
            .map(|i| {
                let at = from.lerp(&to, (f64::from(i) + 0.5) / f64::from(steps));
                0.02 * (-((at - plume.centre_m).norm() / 12e-3).powi(2)).exp()
            })
            .sum::<f64>()
            / f64::from(steps);
        let length_m = (to - from).norm();
        let gained_s = length_m / 343.0 - path.time_s;
        assert!((gained_s / (excess * length_m / 343.0) - 1.0).abs() < 1e-6);
    }
}
