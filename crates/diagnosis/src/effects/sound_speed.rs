//! The air's speed of sound is not the believed one; the delays were computed for the believed one.
//!
//! The wavenumber is ω/c with the true c; delays stay as they were in seconds. For dry air c = 331.3 √(1 + T/273.15 K)
//! m/s (Pierce, *Acoustics*, section 1-9), which turns the speed into a temperature.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Carrier, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct SoundSpeed;

impl Effect for SoundSpeed {
    fn id(&self) -> EffectId {
        EffectId::SoundSpeed
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.92, most: 1.08 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[
                EffectId::DriveFrequency,
                EffectId::AxisScale,
                EffectId::TemperatureGradient,
                EffectId::Pitch,
            ],
            independent_check: Some("a thermometer beside the field gives the speed of sound"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::SpeedOfSound)
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.97], vec![1.03]]
    }

    fn carrier(&self, at: Setting<'_>, carrier: &mut Carrier) {
        carrier.speed_ratio *= at.values[0];
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, context: &Context) -> Finding {
        let c0 = context.believed.medium.speed_of_sound_m_s;
        let speed = fitted[0].map(c0 * fitted[0].value, c0);
        let celsius = |c_m_s: f64| 273.15 * ((c_m_s / 331.3).powi(2) - 1.0);
        let sentence = format!(
            "sound travels at {:.1} ± {:.1} m/s: {:.0} °C in dry air, not the {:.0} °C that the believed {c0:.1} m/s stand for",
            speed.value,
            speed.error,
            celsius(speed.value),
            celsius(c0)
        );
        Finding::new([("c_m_s", speed.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::forward_model::ForwardModel;

    #[test]
    fn faster_air_lengthens_the_wavelength_and_leaves_the_delays() {
        let bench = Bench::new();
        let model = bench.model(EffectId::SoundSpeed, &[1.02]);
        let believed = ForwardModel::believed();
        let ratio =
            believed.wavenumber_rad_m(bench.believed()) / model.wavenumber_rad_m(bench.believed());
        assert!((ratio - 1.02).abs() < 1e-12);
        assert_eq!(model.phases_rad(bench.believed()), believed.phases_rad(bench.believed()));
    }
}
