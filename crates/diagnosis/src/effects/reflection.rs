//! A plane above the field, parallel to the array, returns an image of it (Pierce, *Acoustics*, section 1-4).
//!
//! The cost has a minimum every half wavelength of height: all heights are tried, the coefficient solved for at each.

use fieldgap_acoustics::Simulator;
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Reflection;

impl Effect for Reflection {
    fn id(&self) -> EffectId {
        EffectId::Reflection
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.05, least: 0.0, most: 1500.0 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::StandingWave],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model a free field only; cover reflecting surfaces with absorber, or remove them",
        )
    }

    fn search(&self) -> Search {
        Search::Heights
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        let coefficient = Complex64::new(at.values[1], at.values[2]);
        for (pressure, image) in pressures.iter_mut().zip(field.images(1e-3 * at.values[0])) {
            pressure.coherent += coefficient * image;
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [height, re, im] = [fitted[0], fitted[1], fitted[2]];
        let coefficient = FittedParameter::Complex {
            value: [re.value, im.value],
            standard_error: [re.error, im.error],
        };
        let sentence = format!(
            "a plane at {:.2} ± {:.2} mm above the array reflects {:.1} % of the pressure",
            height.value,
            height.error,
            100.0 * re.value.hypot(im.value)
        );
        Finding::new([("height_mm", height.real()), ("coefficient", coefficient)], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::model::forward_model::ForwardModel;
    use crate::model::observations::Visit;
    use fieldgap_acoustics::Vec3;

    /// The wave that a plane at height h returns to a point at z is that which the array sends to 2 h - z.
    #[test]
    fn a_perfect_plane_adds_the_field_of_the_mirrored_point() {
        let bench = Bench::new();
        let pressure = |model: &ForwardModel<'_>, z_m: f64| {
            let visit = Visit { at_m: Vec3::new(0.01, 0.0, z_m), ..visit() };
            model.pressures_at(bench.believed(), &[visit], &nuisance())[0].coherent
        };
        let mirrored = pressure(&bench.model(EffectId::Reflection, &[200.0, 1.0, 0.0]), 0.15);
        let believed = ForwardModel::believed();
        let expected = pressure(&believed, 0.15) + pressure(&believed, 0.25);
        assert!((mirrored - expected).norm() < 1e-6 * expected.norm(), "{mirrored} {expected}");
    }
}
