//! The drive is off its nominal frequency, as a clock of its own would be; delays are kept in seconds.
//!
//! Wavenumber and phases both scale with the frequency. From magnitudes alone this is nearly a change of sound speed: a scan
//! tells the two apart only by how far the focus moves against how much the pattern's scale changes.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Carrier, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct DriveFrequency;

impl Effect for DriveFrequency {
    fn id(&self) -> EffectId {
        EffectId::DriveFrequency
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed, EffectId::AxisScale],
            independent_check: Some("a frequency counter measures the drive"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::Frequency)
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.98], vec![1.02]]
    }

    fn carrier(&self, at: Setting<'_>, carrier: &mut Carrier) {
        carrier.frequency_ratio *= at.values[0];
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, context: &Context) -> Finding {
        let nominal_hz = context.believed.frequency_hz;
        let sentence = format!(
            "the carrier frequency is {:.1} ± {:.1} Hz, not {nominal_hz:.1} Hz",
            nominal_hz * fitted[0].value,
            nominal_hz * fitted[0].error
        );
        Finding::new([("ratio", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::forward_model::ForwardModel;

    #[test]
    fn a_higher_frequency_shortens_the_wavelength_and_advances_the_phases() {
        let bench = Bench::new();
        let model = bench.model(EffectId::DriveFrequency, &[1.02]);
        let believed = ForwardModel::believed();
        let ratio =
            model.wavenumber_rad_m(bench.believed()) / believed.wavenumber_rad_m(bench.believed());
        assert!((ratio - 1.02).abs() < 1e-12);
        // The largest phase, as some element's is zero.
        let phase_rad = |m: &ForwardModel<'_>| {
            m.phases_rad(bench.believed())
                .into_iter()
                .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a })
        };
        let [true_rad, believed_rad] = [&model, &believed].map(phase_rad);
        assert!((true_rad / believed_rad - 1.02).abs() < 1e-12);
    }
}
