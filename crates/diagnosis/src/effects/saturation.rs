//! Soft compression at high level: v / √(1 + (v/level)²), which loses 3 dB where v = level.
//!
//! It is fitted as the squared ratio of the largest reading to the level, which is zero for a straight receiver. The
//! noise that came in before is compressed with the signal.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Saturation;

impl Effect for Saturation {
    fn id(&self) -> EffectId {
        EffectId::Saturation
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: 0.0, most: 400.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Detector,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Clipping, EffectId::NoiseFloor],
            independent_check: Some(
                "readings at one place at full and at half drive show whether the receiver is linear",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("lower the receiver's amplification")
    }

    /// Noise in proportion to the level behind the detector, or before it: nothing else tells which.
    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1)]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.05], vec![1.0]]
    }

    /// It changes how readings scatter, too, which no slope says.
    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn changes_scatter(&self, at: Setting<'_>) -> bool {
        level_of_3_db(at).is_finite()
    }

    fn transfer(&self, at: Setting<'_>, level: f64) -> f64 {
        let at_3_db = level_of_3_db(at);
        match at_3_db.is_finite() {
            true => level / (1.0 + (level / at_3_db).powi(2)).sqrt(),
            false => level,
        }
    }

    /// d/dv of v / √(1 + (v/l)²) is the cube of the ratio of output to input.
    fn transfer_slope(&self, input: f64, output: f64) -> f64 {
        (output / input).powi(3)
    }

    fn proportional_noise_before_detector(&self, choice: &Choice) -> Option<bool> {
        Some(*choice == Choice::Law(1))
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, context: &Context) -> Finding {
        let ratio = fitted[0].value.max(1e-9).sqrt();
        let level = context.largest_reading / ratio;
        let level = fitted[0].map(level, 0.5 * level / (ratio * ratio));
        let sentence = format!(
            "the receiver compresses: it loses 3 dB at {:.3} ± {:.3} {}",
            level.value, level.error, context.unit
        );
        Finding::new([("level", level.real())], sentence)
    }
}

/// The level at which the receiver loses 3 dB, in the reading's unit; infinite for a linear receiver.
fn level_of_3_db(at: Setting<'_>) -> f64 {
    at.context.largest_reading / at.values[0].max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_receiver_loses_3_db_at_its_level_and_its_slope_is_the_cube_of_the_ratio() {
        let bench = Bench::new();
        let at = bench.at(&[4.0]);
        let level = level_of_3_db(at);
        assert!((level - 0.5 * bench.context.largest_reading).abs() < 1e-12);
        let read = Saturation.transfer(at, level);
        assert!((read / level - 0.5f64.sqrt()).abs() < 1e-12);
        let quotient = (Saturation.transfer(at, level + 1e-7) - read) / 1e-7;
        assert!((Saturation.transfer_slope(level, read) - quotient).abs() < 1e-6);
        assert_eq!(Saturation.transfer(bench.at(&[0.0]), 3.0), 3.0);
    }
}
