//! The robot's axes are turned about z, right-handed, about the array's centre.

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rotation {
    /// The angle, rad.
    rad: Finite,
}

impl Effect for Rotation {
    fn place(&self, at_m: &mut Vec3, _kinematics: &Kinematics) {
        let (sin, cos) = self.rad.get().sin_cos();
        *at_m = Vec3::new(cos * at_m.x - sin * at_m.y, sin * at_m.x + cos * at_m.y, at_m.z);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn a_move_along_the_robots_x_goes_along_the_turned_axis() {
        let mut at = Vec3::new(0.02, 0.0, 0.1);
        effect::<Rotation>("rad = 0.3").place(&mut at, &Kinematics::resting());
        assert!((at.y.atan2(at.x) - 0.3).abs() < 1e-12 && (at.z - 0.1).abs() < 1e-15);
    }
}
