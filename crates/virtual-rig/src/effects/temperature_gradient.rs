//! The sound speed varies linearly through the field: c(x) = c (1 + g·x), x in the array's frame.
//!
//! Along a straight path the speed goes linearly from c₁ to c₂, and the time is ∫ ds/c = d ln(c₂/c₁) / (c₂ - c₁), exactly;
//! the bending of rays is left out (it lengthens a path by the order of (g d)²/24).

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TemperatureGradient {
    /// Relative change of speed per metre, along x.
    gx: Finite,
    /// Along y.
    gy: Finite,
    /// Along z.
    gz: Finite,
}

impl Effect for TemperatureGradient {
    fn path(&self, path: &mut Path) {
        let gradient = Vec3::new(self.gx.get(), self.gy.get(), self.gz.get());
        let distance_m = path.distance_m();
        // Below a tenth of the nominal speed the linear law has left physics.
        let speed_at = |at_m: Vec3| path.speed_m_s * (1.0 + gradient.dot(&at_m)).max(0.1);
        let (from_m_s, to_m_s) = (speed_at(path.from_m), speed_at(path.to_m));
        let ratio = to_m_s / from_m_s - 1.0;
        // ln(1 + r) / r, by its series where the quotient would lose digits.
        let mean = if ratio.abs() < 1e-6 { 1.0 - ratio / 2.0 } else { ratio.ln_1p() / ratio };
        path.time_s += distance_m / from_m_s * mean - distance_m / path.speed_m_s;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_time_is_the_integral_of_slowness_along_the_path() {
        let effect = effect::<TemperatureGradient>("gx = 0.2\ngy = -0.1\ngz = 0.4");
        let (from, to) = (Vec3::new(0.02, -0.01, 0.0), Vec3::new(-0.03, 0.02, 0.2));
        let mut path = Path::straight(0, from, to, 343.0);
        effect.path(&mut path);
        let n = 10_000;
        let slowness: f64 = (0..n)
            .map(|i| {
                let at = from.lerp(&to, (f64::from(i) + 0.5) / f64::from(n));
                1.0 / (343.0 * (1.0 + Vec3::new(0.2, -0.1, 0.4).dot(&at)))
            })
            .sum::<f64>()
            / f64::from(n);
        assert!((path.time_s / (slowness * (to - from).norm()) - 1.0).abs() < 1e-9);
    }
}
