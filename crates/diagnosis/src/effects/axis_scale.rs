//! Steps a millimetre are wrong: a commanded millimetre is truly this long, about the array's centre.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Visit;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct AxisScale;

impl Effect for AxisScale {
    fn id(&self) -> EffectId {
        EffectId::AxisScale
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 },
            Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 },
            Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed, EffectId::DriveFrequency],
            independent_check: Some("a ruler beside the robot measures its travel"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("correct the steps per millimetre in the robot's firmware")
    }

    fn position(&self, at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        at_m.component_mul(&Vec3::from_column_slice(at.values))
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        let sentence = format!(
            "a commanded millimetre is {:.4} ± {:.4} mm along x, {:.4} ± {:.4} along y and {:.4} ± {:.4} along z",
            x.value, x.error, y.value, y.error, z.value, z.error
        );
        Finding::new([("x", x.real()), ("y", y.real()), ("z", z.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};

    #[test]
    fn each_axis_is_stretched_about_the_centre_of_the_array() {
        let bench = Bench::new();
        let at_m =
            AxisScale.position(bench.at(&[1.1, 0.9, 1.0]), &visit(), Vec3::new(0.01, 0.01, 0.1));
        assert!((at_m - Vec3::new(0.011, 0.009, 0.1)).norm() < 1e-12);
    }
}
