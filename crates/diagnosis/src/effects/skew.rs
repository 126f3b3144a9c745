//! The robot's y axis leans towards x instead of standing square on it.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::{Observations, Visit};
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Skew;

impl Effect for Skew {
    fn id(&self) -> EffectId {
        EffectId::Skew
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Rotation],
            independent_check: Some("a try square shows the angle between the robot's axes"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "no set-up file describes axes that are not square; align those of the robot",
        )
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.tell_axes()
    }

    fn position(&self, at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        let (sin, cos) = at.values[0].sin_cos();
        Vec3::new(at_m.x + sin * at_m.y, cos * at_m.y, at_m.z)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "the robot's y axis leans by {:.2} ± {:.2} degrees towards x",
            fitted[0].value.to_degrees(),
            fitted[0].error.to_degrees()
        );
        Finding::new([("rad", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};

    #[test]
    fn a_leaning_y_axis_keeps_its_length() {
        let bench = Bench::new();
        let at_m = Skew.position(bench.at(&[0.1]), &visit(), Vec3::new(0.0, 0.02, 0.1));
        let (sin, cos) = 0.1f64.sin_cos();
        assert!((at_m - Vec3::new(0.02 * sin, 0.02 * cos, 0.1)).norm() < 1e-12);
    }
}
