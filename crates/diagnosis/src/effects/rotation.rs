//! The robot's axes are turned about z, right-handed, about the array's centre.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::{Observations, Visit};
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct Rotation;

impl Effect for Rotation {
    fn id(&self) -> EffectId {
        EffectId::Rotation
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.002, least: -0.8, most: 0.8 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Skew],
            independent_check: Some(
                "a straight edge along a row of elements, traced by the robot, shows the angle",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::Turn)
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.tell_axes()
    }

    fn position(&self, at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        let (sin, cos) = at.values[0].sin_cos();
        Vec3::new(cos * at_m.x - sin * at_m.y, sin * at_m.x + cos * at_m.y, at_m.z)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "the robot's axes are turned by {:.2} ± {:.2} degrees about z",
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
    fn a_quarter_turn_leads_x_to_y() {
        let bench = Bench::new();
        let quarter = std::f64::consts::FRAC_PI_2;
        let at_m = Rotation.position(bench.at(&[quarter]), &visit(), Vec3::new(0.01, 0.0, 0.1));
        assert!((at_m - Vec3::new(0.0, 0.01, 0.1)).norm() < 1e-12);
    }
}
