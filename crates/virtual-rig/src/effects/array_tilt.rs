//! The array's plane is tilted against the scan's axes, about its centre: first about x, then about y.

use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ArrayTilt {
    /// Right-handed turn about x, rad.
    about_x_rad: Finite,
    /// Right-handed turn about y, rad.
    about_y_rad: Finite,
}

impl Effect for ArrayTilt {
    fn array(&self, array: &mut TrueArray, _rng: CounterRng) {
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), self.about_y_rad.get())
            * Rotation3::from_axis_angle(&Vector3::x_axis(), self.about_x_rad.get());
        for element in &mut array.elements {
            element.centre_m = tilt * element.centre_m;
            element.normal = tilt * element.normal;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn a_turn_about_x_lifts_elements_along_y_and_tilts_the_normals() {
        let mut array = TrueArray::of_two();
        array.elements[0].centre_m = Vector3::new(0.0, 0.03, 0.0);
        effect::<ArrayTilt>("about_x_rad = 0.1\nabout_y_rad = 0.0")
            .array(&mut array, CounterRng::new(0));
        let element = array.elements[0];
        assert!((element.centre_m.z - 0.03 * 0.1f64.sin()).abs() < 1e-12);
        assert!((element.normal.y + 0.1f64.sin()).abs() < 1e-12);
    }
}
