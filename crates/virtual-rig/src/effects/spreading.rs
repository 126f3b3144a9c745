//! Another decay with distance: the amplitude is proportional to d^-exponent.
//!
//! Without this effect it is spherical, exponent 1. The level at 0.1 m does not change.

use serde::Deserialize;

use super::{Effect, Path};
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spreading {
    /// 1: spherical; 0.5: cylindrical; 0: none.
    exponent: Finite,
}

/// Distance at which the level does not change, m.
const REFERENCE_M: f64 = 0.1;

impl Effect for Spreading {
    fn path(&self, path: &mut Path) {
        path.gain *= (path.distance_m() / REFERENCE_M).powf(1.0 - self.exponent.get());
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn spherical_decay_becomes_the_given_one() {
        let spreading = effect::<Spreading>("exponent = 0.5");
        let level = |distance: f64| {
            let mut path = Path::straight(0, Vec3::zeros(), Vec3::z() * distance, 343.0);
            spreading.path(&mut path);
            path.gain / distance
        };
        assert!((level(0.4) / level(0.1) - 0.5).abs() < 1e-12);
        assert!((level(0.1) - 10.0).abs() < 1e-12);
    }
}
