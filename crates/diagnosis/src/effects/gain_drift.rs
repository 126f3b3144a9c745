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

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, believed: &Context) -> Finding {
        if let [relative, constants] = *fitted {
            let Context { lasts_s, .. } = *believed;
            let time_constant =
                constants.map(lasts_s / constants.value, lasts_s / constants.value.powi(2));
            let sentence = format!(
                "the level changes by {:.1} ± {:.1} % from the beginning to the end of the scan, most of it at first, as that of a rig that warms up: \
                 it settles with a time constant of {:.0} ± {:.0} s",
                100.0 * relative.value,
                100.0 * relative.error,
                time_constant.value,
                time_constant.error
            );
            let parameters =
                [("relative", relative.real()), ("time_constant_s", time_constant.real())];
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
    use crate::fitted_parameter::FittedParameter;

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

    /// A scan of 600 s that lasts 4 ± 0.4 time constants: each has 150 s, with a tenth of it as error.
    #[test]
    fn the_time_constant_is_told_in_seconds() {
        let bench = Bench::new();
        let fitted = [(-0.1, 0.01), (4.0, 0.4)];
        let fitted = fitted.map(|(value, error)| Estimate { value, error });
        let found = GainDrift.describe(&fitted, &SETTLING, &bench.context);
        let FittedParameter::Real { value, standard_error } = found.parameters["time_constant_s"]
        else {
            panic!("{found:?}")
        };
        assert!((value - 150.0).abs() < 1e-9 && (standard_error - 15.0).abs() < 1e-9);
        assert!(found.sentence.contains("time constant of 150 ± 15 s"), "{}", found.sentence);
    }
}
