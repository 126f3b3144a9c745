//! Attenuation along each path beyond the model: exp(-α d), α = db_per_m ln 10 / 20.
//!
//! Air at 20 °C and 50 % humidity takes 1.3 dB/m at 40 kHz (ISO 9613-1). A believed decay that is too strong shows as a
//! value below zero.

use std::f64::consts::LN_10;

use fieldgap_acoustics::{Propagation, Simulator};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Absorption;

impl Effect for Absorption {
    fn id(&self) -> EffectId {
        EffectId::Absorption
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.5, least: -40.0, most: 80.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Spreading, EffectId::GainDrift],
            independent_check: Some(
                "a thermometer and a hygrometer give the absorption of the air",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "how the level falls with distance is part of a simulator, not of a set-up; try another --simulator",
        )
    }

    fn air(&self, at: Setting<'_>, _speed_m_s: f64, air: &mut Propagation) {
        air.attenuation_np_m += at.values[0] * LN_10 / 20.0;
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "each path is attenuated by {:.2} ± {:.2} dB per metre beyond the model (air at 20 °C and 50 % humidity: 1.3)",
            fitted[0].value, fitted[0].error
        );
        Finding::new([("db_per_m", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn twenty_decibels_a_metre_divide_the_amplitude_by_ten() {
        let bench = Bench::new();
        let mut air = Propagation::default();
        Absorption.air(bench.at(&[20.0]), 343.0, &mut air);
        assert!(((-air.attenuation_np_m).exp() - 0.1).abs() < 1e-12);
    }
}
