//! Steps a millimetre are wrong: a commanded millimetre is truly this long.
//!
//! The scale acts about the array's centre: labs find the origin by driving to the array, so that is where the
//! robot's numbers are right.

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Carriage;
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
    fn place(&self, at_m: &mut Vec3, _carriage: &Carriage) {
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
        effect::<AxisScale>("x = 1.1\ny = 1.0\nz = 0.9").place(&mut at, &Carriage::resting());
        assert!((at - Vec3::new(0.011, 0.01, 0.09)).norm() < 1e-12);
    }
}
