//! Sound bounces between receiver and array: p (1 + Γ exp(2 i k z)), a ripple of half a wavelength in z.

use fieldgap_acoustics::Simulator;
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct StandingWave;

impl Effect for StandingWave {
    fn id(&self) -> EffectId {
        EffectId::StandingWave
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Reflection],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model a free field only; cover reflecting surfaces with absorber, or remove them",
        )
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        let coefficient = Complex64::new(at.values[0], at.values[1]);
        if coefficient == Complex64::ZERO {
            return;
        }
        let wavenumber = field.wavenumber_rad_m();
        for (pressure, at_m) in pressures.iter_mut().zip(field.points_m()) {
            let round_trip = Complex64::from_polar(1.0, 2.0 * wavenumber * at_m.z);
            pressure.coherent *= 1.0 + coefficient * round_trip;
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [re, im] = [fitted[0], fitted[1]];
        let coefficient = FittedParameter::Complex {
            value: [re.value, im.value],
            standard_error: [re.error, im.error],
        };
        let sentence = format!(
            "sound reflected between receiver and array adds {:.1} % of the pressure",
            100.0 * re.value.hypot(im.value)
        );
        Finding::new([("coefficient", coefficient)], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::mirror::Mirror;
    use fieldgap_acoustics::Vec3;

    struct Along(Vec<Vec3>);

    impl SurroundingField for Along {
        fn points_m(&self) -> &[Vec3] {
            &self.0
        }
        fn wavenumber_rad_m(&self) -> f64 {
            std::f64::consts::TAU / 8e-3
        }
        fn images(&self, _mirror: &Mirror) -> Vec<Complex64> {
            Vec::new()
        }
        fn waves_at(&self, _at_m: &Vec3) -> Vec<(Vec3, Complex64)> {
            Vec::new()
        }
    }

    /// At a wavelength of 8 mm the largest and smallest levels, (1 ± Γ), lie 2 mm apart, and the ripple repeats every 4 mm.
    #[test]
    fn the_ripple_repeats_every_half_wavelength() {
        let bench = Bench::new();
        let field = Along((0..4).map(|n| Vec3::z() * (0.08 + 2e-3 * f64::from(n))).collect());
        let mut pressures = vec![Pressure::steady(Complex64::ONE); 4];
        StandingWave.added_waves(bench.at(&[0.1, 0.0]), &field, &mut pressures);
        for (pressure, level) in pressures.iter().zip([1.1, 0.9, 1.1, 0.9]) {
            assert!((pressure.coherent.norm() - level).abs() < 1e-9, "{pressures:?}");
        }
    }
}
