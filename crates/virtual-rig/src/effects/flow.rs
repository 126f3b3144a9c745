//! A steady wind across the field.
//!
//! Sound is carried along: a path of direction n takes d / (c + v·n) (Pierce, *Acoustics*, section 8-1, straight rays, to
//! first order in the Mach number).

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Flow {
    /// Wind along x, m/s.
    vx_m_s: Finite,
    /// Wind along y, m/s.
    vy_m_s: Finite,
}

impl Effect for Flow {
    fn path(&self, path: &mut Path) {
        let wind_m_s = Vec3::new(self.vx_m_s.get(), self.vy_m_s.get(), 0.0);
        let distance_m = path.distance_m();
        let along_m_s = wind_m_s.dot(&path.direction());
        path.time_s += distance_m / (path.speed_m_s + along_m_s) - distance_m / path.speed_m_s;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn sound_is_faster_with_the_wind_and_slower_against_it() {
        let flow = effect::<Flow>("vx_m_s = 3.0\nvy_m_s = 0.0");
        for (to, speed) in [(Vec3::x(), 346.0), (-Vec3::x(), 340.0), (Vec3::z(), 343.0)] {
            let mut path = Path::straight(0, Vec3::zeros(), to, 343.0);
            flow.path(&mut path);
            assert!((path.time_s - 1.0 / speed).abs() < 1e-15);
        }
    }
}
