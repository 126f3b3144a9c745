//! The robot's origin is not the array's: in the array's frame it stands beside it.
//!
//! A fraction of a millimetre is what careful setting-up leaves and belongs to the registration; this is more.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Visit;
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct Offset;

impl Effect for Offset {
    fn id(&self) -> EffectId {
        EffectId::Offset
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some("`fieldgap rig find-axis` finds the centre of the array"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::Origin)
    }

    fn is_told_by_shift(&self) -> bool {
        true
    }

    fn position(&self, at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        at_m + 1e-3 * Vec3::from_column_slice(at.values)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        let sentence = format!(
            "the robot's origin is {:.2} ± {:.2} mm along x, {:.2} ± {:.2} along y and {:.2} ± {:.2} along z from the array's",
            x.value, x.error, y.value, y.error, z.value, z.error
        );
        Finding::new([("x_mm", x.real()), ("y_mm", y.real()), ("z_mm", z.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};

    #[test]
    fn the_origin_is_added_to_every_position() {
        let bench = Bench::new();
        let at_m = Offset.position(bench.at(&[1.0, -2.0, 3.0]), &visit(), Vec3::zeros());
        assert!((at_m - 1e-3 * Vec3::new(1.0, -2.0, 3.0)).norm() < 1e-12);
    }
}
