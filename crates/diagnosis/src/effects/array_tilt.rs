//! The array's plane is tilted against the scan's axes about its centre: first about x, then about y.

use fieldgap_acoustics::{Element, Simulator, Vec3};
use nalgebra::Rotation3;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct ArrayTilt;

impl Effect for ArrayTilt {
    fn id(&self) -> EffectId {
        EffectId::ArrayTilt
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 },
            Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::TemperatureGradient],
            independent_check: Some(
                "a dial gauge on the robot, moved along the array's face, measures the tilt",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::Tilt)
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        let tilt = Rotation3::from_axis_angle(&Vec3::y_axis(), at.values[1])
            * Rotation3::from_axis_angle(&Vec3::x_axis(), at.values[0]);
        for element in elements {
            element.centre_m = tilt * element.centre_m;
            element.normal = tilt * element.normal;
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y] = [fitted[0], fitted[1]];
        let sentence = format!(
            "the array is tilted by {:.2} ± {:.2} degrees about x and {:.2} ± {:.2} about y",
            x.value.to_degrees(),
            x.error.to_degrees(),
            y.value.to_degrees(),
            y.error.to_degrees()
        );
        Finding::new([("about_x_rad", x.real()), ("about_y_rad", y.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn an_array_tilted_about_x_looks_towards_minus_y() {
        let bench = Bench::new();
        let mut elements = [Element::at(0.0, 0.01)];
        ArrayTilt.elements(bench.at(&[0.1, 0.0]), &mut elements);
        let (sin, cos) = 0.1f64.sin_cos();
        assert!((elements[0].normal - Vec3::new(0.0, -sin, cos)).norm() < 1e-12);
        assert!((elements[0].centre_m - 0.01 * Vec3::new(0.0, cos, sin)).norm() < 1e-12);
    }
}
