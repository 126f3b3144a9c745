//! The robot's origin differs from the array's: these are its coordinates in the array's frame.

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Coordinate;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Offset {
    /// Along x, mm.
    x_mm: Coordinate,
    /// Along y, mm.
    y_mm: Coordinate,
    /// Along z, mm.
    z_mm: Coordinate,
}

impl Effect for Offset {
    fn place(&self, at_m: &mut Vec3, _kinematics: &Kinematics) {
        *at_m += Vec3::new(self.x_mm.get(), self.y_mm.get(), self.z_mm.get()) * 1e-3;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_nozzle_stands_beside_where_the_robot_says() {
        let mut at = Vec3::new(0.01, 0.02, 0.1);
        effect::<Offset>("x_mm = 1.0\ny_mm = -2.0\nz_mm = 0.5")
            .place(&mut at, &Kinematics::resting());
        assert!((at - Vec3::new(0.011, 0.018, 0.1005)).norm() < 1e-12);
    }
}
