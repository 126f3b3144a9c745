//! The level drifts through the scan, linearly in time or as a rig does that warms up: fast at first, by 1 - exp(-t/τ).

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct GainDrift;

/// The choice of a drift that settles.
const SETTLING: Choice = Choice::Law(1);

/// From the first reading to the last, and how many time constants the scan lasts.
const WARMING_UP: [Parameter; 2] = [
    Parameter { neutral: 0.0, scale: 0.005, least: -0.95, most: 10.0 },
    Parameter { neutral: 4.0, scale: 0.1, least: 0.5, most: 60.0 },
];

impl Effect for GainDrift {
    fn id(&self) -> EffectId {
        EffectId::GainDrift
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.005, least: -0.95, most: 10.0 }]
    }

    fn parameters_of(&self, choice: &Choice) -> &'static [Parameter] {
        if *choice == SETTLING { &WARMING_UP } else { self.parameters() }
    }

    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), SETTLING]
    }

    /// A linear drift as one that settles, and back.
    fn carried(&self, values: Vec<f64>, choice: &Choice) -> Vec<f64> {
        match *choice == SETTLING {
            true => vec![values[0], values.get(1).copied().unwrap_or(WARMING_UP[1].neutral)],
            false => values[..1].to_vec(),
        }
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Gain,
            timing: Timing::Moment,
            per_element: PerElement::No,
            mimics: &[EffectId::Absorption],
            independent_check: Some(
                "readings at one place over the duration of a scan show a drift",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "simulations have no drift; let the rig warm up, or add a [reference] to the plan",
        )
    }

    fn gain(&self, at: Setting<'_>, progress: f64) -> f64 {
        let settled = |constants: f64, progress: f64| 1.0 - (-constants * progress).exp();
        let share = match *at.values {
            [_, constants] => settled(constants, progress) / settled(constants, 1.0),
            _ => progress,
        };
        1.0 + at.values[0] * share
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        if let [relative, constants] = *fitted {
            let sentence = format!(
                "the level changes by {:.1} ± {:.1} % from the beginning to the end of the scan, most of it at first, as a rig does that warms up: \
                 the scan lasts {:.1} ± {:.1} time constants",
                100.0 * relative.value,
                100.0 * relative.error,
                constants.value,
                constants.error
            );
            let parameters = [("relative", relative.real()), ("time_constants", constants.real())];
            return Finding::new(parameters, sentence);
        }
        let sentence = format!(
            "the level changes by {:.1} ± {:.1} % from the beginning to the end of the scan",
            100.0 * fitted[0].value,
            100.0 * fitted[0].error
        );
        Finding::new([("relative", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_gain_at_the_end_is_off_by_the_drift() {
        let bench = Bench::new();
        assert_eq!(GainDrift.gain(bench.at(&[-0.1]), 0.0), 1.0);
        assert!((GainDrift.gain(bench.at(&[-0.1]), 1.0) - 0.9).abs() < 1e-12);
    }

    /// After a time constant 63 % of what a settled drift changes is done.
    #[test]
    fn a_drift_that_settles_is_fast_at_first() {
        let bench = Bench::new();
        let gain = |progress| GainDrift.gain(bench.at(&[0.2, 50.0]), progress);
        assert!((gain(1.0) - 1.2).abs() < 1e-12);
        assert!((gain(0.02) - 1.0 - 0.2 * 0.632).abs() < 1e-3);
    }
}
