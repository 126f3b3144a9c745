//! The speed of sound varies linearly through the field: c(x) = c (1 + g·x).
//!
//! A kelvin changes it by 0.17 %. Straight rays; their bending lengthens a path only by the order of (g d)²/24.

use fieldgap_acoustics::{Propagation, Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct TemperatureGradient;

impl Effect for TemperatureGradient {
    fn id(&self) -> EffectId {
        EffectId::TemperatureGradient
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed, EffectId::AxisScale],
            independent_check: Some(
                "two thermometers, one at the array and one at the far end of the scan, show a gradient of temperature",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model still air of one temperature only; keep draughts and heat sources away",
        )
    }

    fn air(&self, at: Setting<'_>, _speed_m_s: f64, air: &mut Propagation) {
        air.gradient_per_m += Vec3::from_column_slice(at.values);
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        // dc/c = dT / 2T at 293 K.
        let kelvin_m = |g: f64| g * 2.0 * 293.15;
        let sentence = format!(
            "the speed of sound changes through the field by {:.1} % a metre along x, {:.1} along y, {:.1} along z: \
             {:.0}, {:.0} and {:.0} kelvin a metre",
            100.0 * x.value,
            100.0 * y.value,
            100.0 * z.value,
            kelvin_m(x.value),
            kelvin_m(y.value),
            kelvin_m(z.value)
        );
        Finding::new([("gx", x.real()), ("gy", y.real()), ("gz", z.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_gradient_of_the_speed_of_sound_is_that_of_the_air() {
        let bench = Bench::new();
        let mut air = Propagation::default();
        TemperatureGradient.air(bench.at(&[0.1, -0.2, 0.3]), 343.0, &mut air);
        assert_eq!(air.gradient_per_m, Vec3::new(0.1, -0.2, 0.3));
    }
}
