//! The steps per millimetre are wrong: each axis moves by this many millimetres for each commanded one.
//!
//! The scale acts about the array's centre. The origin is found by driving to the array, so the robot's coordinates are right
//! there.

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisScale {
    /// True over commanded, along x.
    x: Positive,
    /// Along y.
    y: Positive,
    /// Along z.
    z: Positive,
}

impl Effect for AxisScale {
    fn place(&self, at_m: &mut Vec3, _kinematics: &Kinematics) {
        at_m.component_mul_assign(&Vec3::new(self.x.get(), self.y.get(), self.z.get()));
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn each_axis_has_its_own_length() {
        let mut at = Vec3::new(0.01, 0.01, 0.1);
        effect::<AxisScale>("x = 1.1\ny = 1.0\nz = 0.9").place(&mut at, &Kinematics::resting());
        assert!((at - Vec3::new(0.011, 0.01, 0.09)).norm() < 1e-12);
    }
}
