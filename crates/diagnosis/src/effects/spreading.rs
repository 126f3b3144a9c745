//! The on-axis decay follows another law, d^-exponent: 1 is spherical, 0.5 cylindrical, 0 none.
//!
//! It stands in the place of the simulator's own law, fitted or spherical.

use fieldgap_acoustics::Simulator;
use fieldgap_acoustics::transducer::OnAxis;
use fieldgap_text::{Uncertain, uncertain};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Radiation, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Spreading;

impl Effect for Spreading {
    fn id(&self) -> EffectId {
        EffectId::Spreading
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.02, least: -1.0, most: 4.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Absorption],
            independent_check: Some(
                "one element alone, scanned along its axis, shows its decay with distance (`fieldgap characterize`)",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "how the level falls with distance is part of a simulator, not of a set-up; try another --simulator",
        )
    }

    fn begins_flat(&self, believed: &Context) -> bool {
        believed.believed.transducer().on_axis() != OnAxis::Spherical
    }

    fn radiation(&self, at: Setting<'_>, radiation: &mut Radiation<'_>) {
        radiation.on_axis = Some(OnAxis::Power { exponent: at.values[0] });
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let exponent = fitted[0].value;
        let size = Uncertain { value: exponent.abs(), standard_error: fitted[0].error };
        let sentence = match exponent < 0.0 {
            true => format!("pressure grows with distance as d^{}", uncertain(size)),
            false => {
                format!("pressure falls with distance as d^-{} (1 is spherical)", uncertain(size))
            }
        };
        Finding::new([("exponent", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::model::observations::Visit;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn twice_as_far_on_the_axis_the_pressure_falls_by_two_to_the_exponent() {
        let bench = Bench::of_one_element();
        let model = bench.model(EffectId::Spreading, &[0.5]);
        let level = |z_m: f64| {
            let visit = Visit { at_m: Vec3::z() * z_m, ..visit() };
            model.pressures_at(bench.believed(), &[visit], &nuisance())[0].coherent.norm()
        };
        assert!((level(0.1) / level(0.2) - 2f64.sqrt()).abs() < 1e-4);
    }
}
