//! The drive is off its nominal frequency, as a clock of its own would be; delays are kept in seconds.
//!
//! Wavenumber and phases both scale with the frequency. From magnitudes alone this is nearly a change of sound speed: a scan
//! tells the two apart only by how far the focus moves against how much the pattern's scale changes.
//!
//! A driver that counts delays in steps of its period emits them within one period: what is longer starts a period later, which is the
//! same sound at the nominal frequency alone. Which of both a driver does is a choice of the fit.

use std::f64::consts::TAU;

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Carrier, Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// Delays are emitted as they are commanded, or within one period of the nominal frequency.
const AS_COMMANDED: Choice = Choice::Law(0);
const WITHIN_A_PERIOD: Choice = Choice::Law(1);

/// Share of a period by which a delay may exceed whole periods and still be of that many: far above rounding.
const WHOLE: f64 = 1e-9;

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

    fn choices(&self) -> Vec<Choice> {
        vec![AS_COMMANDED, WITHIN_A_PERIOD]
    }

    fn carrier(&self, at: Setting<'_>, carrier: &mut Carrier) {
        carrier.frequency_ratio *= at.values[0];
    }

    fn drive_phases(
        &self,
        at: Setting<'_>,
        _drive: usize,
        carrier: &Carrier,
        phases_rad: &mut [f64],
    ) {
        if *at.choice == WITHIN_A_PERIOD {
            let period_rad = TAU * carrier.frequency_ratio;
            for phase_rad in phases_rad {
                *phase_rad -= period_rad * (*phase_rad / period_rad + WHOLE).floor();
            }
        }
    }

    fn describe(&self, fitted: &[Estimate], choice: &Choice, context: &Context) -> Finding {
        let nominal_hz = context.believed.frequency_hz;
        let mut sentence = format!(
            "the carrier frequency is {:.1} ± {:.1} Hz, not {nominal_hz:.1} Hz",
            nominal_hz * fitted[0].value,
            nominal_hz * fitted[0].error
        );
        if *choice != WITHIN_A_PERIOD {
            return Finding::new([("ratio", fitted[0].real())], sentence);
        }
        sentence += ", and the driver emits delays within one period";
        let within = FittedParameter::Real { value: 1.0, standard_error: 0.0 };
        Finding::new([("ratio", fitted[0].real()), ("within_a_period", within)], sentence)
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

    /// A delay of 1.3 periods is one of 0.3, whatever the frequency.
    #[test]
    fn a_driver_that_counts_within_its_period_leaves_whole_periods_out() {
        let bench = Bench::new();
        let carrier = Carrier { speed_ratio: 1.0, frequency_ratio: 1.02 };
        let periods = [0.0, 0.3, 1.0, 1.3, 2.999];
        let after = |choice: &Choice| {
            let mut phases_rad = periods.map(|periods| TAU * 1.02 * periods);
            let at = Setting { choice, ..bench.at(&[1.02]) };
            DriveFrequency.drive_phases(at, 0, &carrier, &mut phases_rad);
            phases_rad.map(|phase_rad| phase_rad / (TAU * 1.02))
        };
        for (found, expected) in
            after(&WITHIN_A_PERIOD).into_iter().zip([0.0, 0.3, 0.0, 0.3, 0.999])
        {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        assert_eq!(after(&AS_COMMANDED), periods);
    }
}
