//! The robot's y axis leans towards x: the two are not perpendicular.

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Skew {
    /// Angle by which y leans, rad.
    rad: Finite,
}

impl Effect for Skew {
    fn place(&self, at_m: &mut Vec3, _kinematics: &Kinematics) {
        let (sin, cos) = self.rad.get().sin_cos();
        *at_m = Vec3::new(at_m.x + sin * at_m.y, cos * at_m.y, at_m.z);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_angle_between_the_axes_is_less_than_a_right_one_by_the_lean() {
        let skew = effect::<Skew>("rad = 0.05");
        let (mut x, mut y) = (Vec3::x(), Vec3::y());
        skew.place(&mut x, &Kinematics::resting());
        skew.place(&mut y, &Kinematics::resting());
        assert!((x.angle(&y) - (FRAC_PI_2 - 0.05)).abs() < 1e-12);
        assert!((y.norm() - 1.0).abs() < 1e-12);
    }

    use std::f64::consts::FRAC_PI_2;
}
