//! The level drifts through the scan, linearly in time.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct GainDrift;

impl Effect for GainDrift {
    fn id(&self) -> EffectId {
        EffectId::GainDrift
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.005, least: -0.95, most: 10.0 }]
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
        1.0 + at.values[0] * progress
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
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
}
