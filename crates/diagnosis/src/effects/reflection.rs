//! A plane above the field, parallel to the array, returns an image of it (Pierce, *Acoustics*, section 1-4).
//!
//! A shift of the plane mainly turns the phase of the images, by 2 k for each metre. The fit works on the coefficient with this turn taken out,
//! so that it can follow the height over many wavelengths; many heights are tried as well, the coefficient solved for at each.

use fieldgap_acoustics::Simulator;
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::mirror::Mirror;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Reflection;

/// The turn of the images' phase on the axis by the height of the plane, rad/mm: they are twice as far away as it.
fn turn_per_mm(context: &Context) -> f64 {
    2e-3 * context.believed.medium.wavenumber_rad_m(context.believed.frequency_hz)
}

fn turn(height_mm: f64, context: &Context) -> Complex64 {
    Complex64::cis(turn_per_mm(context) * height_mm)
}

impl Reflection {
    /// A plane at a height, m, that returns so much, as the numbers that a fit works on.
    pub fn at_height(height_m: f64, coefficient: Complex64, context: &Context) -> Vec<f64> {
        let turned = coefficient * turn(1e3 * height_m, context);
        vec![1e3 * height_m, turned.re, turned.im]
    }
}

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
        let turned = Complex64::new(at.values[1], at.values[2]);
        let coefficient = turned * turn(at.values[0], at.context).conj();
        for (pressure, image) in
            pressures.iter_mut().zip(field.images(&Mirror::at_height(1e-3 * at.values[0])))
        {
            pressure.coherent += coefficient * image;
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, believed: &Context) -> Finding {
        let [height, re, im] = [fitted[0], fitted[1], fitted[2]];
        let turn = turn(height.value, believed).conj();
        let value = Complex64::new(re.value, im.value) * turn;
        // The error of the height is one of the phase, at right angles to the coefficient.
        let by_height = turn_per_mm(believed) * height.error;
        let error = |along: f64, across: f64, other: f64| {
            (along * re.error).hypot(across * im.error).hypot(other * by_height)
        };
        let coefficient = FittedParameter::Complex {
            value: [value.re, value.im],
            standard_error: [error(turn.re, turn.im, value.im), error(turn.im, turn.re, value.re)],
        };
        let sentence = format!(
            "a plane at {:.2} ± {:.2} mm above the array reflects {:.1} % of the pressure",
            height.value,
            height.error,
            100.0 * value.norm()
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
        let perfect = Reflection::at_height(0.2, Complex64::ONE, &bench.context);
        let mirrored = pressure(&bench.model(EffectId::Reflection, &perfect), 0.15);
        let believed = ForwardModel::believed();
        let expected = pressure(&believed, 0.15) + pressure(&believed, 0.25);
        assert!((mirrored - expected).norm() < 1e-6 * expected.norm(), "{mirrored} {expected}");
    }
}
