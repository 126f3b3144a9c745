//! A floor that the detector adds in power: √(v² + level²).
//!
//! It is fitted as the squared ratio to the largest reading, which is zero for none; what dark readings reads says it best.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::limits::FLOOR_NOT_SEEN;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;
use crate::statistics::scatter::Scatter;

/// The effect.
pub(crate) struct NoiseFloor;

impl Effect for NoiseFloor {
    fn id(&self) -> EffectId {
        EffectId::NoiseFloor
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 1e-05, least: 0.0, most: 1.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Detector,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Saturation],
            independent_check: None,
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("the simulations are free of noise; shield the receiver, or raise the drive")
    }

    /// Noise in proportion to the level behind the detector, or before it: nothing else tells which.
    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1)]
    }

    fn starts(&self, context: &Context) -> Vec<Vec<f64>> {
        match (context.dark_floor / context.largest_reading).powi(2) {
            0.0 => vec![vec![1e-7], vec![1e-6], vec![1e-4], vec![1e-2]],
            in_silence => vec![vec![in_silence]],
        }
    }

    /// It changes how readings scatter, too, which no slope says.
    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn changes_scatter(&self, at: Setting<'_>) -> bool {
        self.floor(at) > 0.0
    }

    fn transfer(&self, at: Setting<'_>, level: f64) -> f64 {
        with_floor(level, self.floor(at))
    }

    /// Of √(v² + f²).
    fn transfer_slope(&self, input: f64, output: f64) -> f64 {
        input / output
    }

    fn floor(&self, at: Setting<'_>) -> f64 {
        at.context.largest_reading * at.values[0].max(0.0).sqrt()
    }

    fn proportional_noise_before_detector(&self, choice: &Choice) -> Option<bool> {
        Some(*choice == Choice::Law(1))
    }

    /// Nothing reads less than the floor.
    fn most(&self, scatter: &Scatter, context: &Context) -> Vec<f64> {
        vec![(scatter.most_floor / context.largest_reading).powi(2)]
    }

    /// What dark readings say of a floor: for it, or, where they could have shown one and did not, against it.
    fn evidence_of_dark_readings(&self, scatter: &Scatter) -> f64 {
        match scatter.floor > 0.0 || scatter.most_floor.is_infinite() {
            true => scatter.floor_evidence,
            false => -FLOOR_NOT_SEEN,
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, context: &Context) -> Finding {
        let ratio = fitted[0].value.max(1e-12).sqrt();
        let level =
            fitted[0].map(context.largest_reading * ratio, 0.5 * context.largest_reading / ratio);
        let sentence = format!(
            "a floor of {:.4} ± {:.4} {} is added in power to every reading",
            level.value, level.error, context.unit
        );
        Finding::new([("level", level.real())], sentence)
    }
}

/// A level with a floor added in power. (The library's hypotenuse guards against overflow, at five times the time.)
fn with_floor(level: f64, floor: f64) -> f64 {
    (level * level + floor * floor).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn a_level_as_large_as_the_floor_reads_root_two_times_that_and_its_slope_is_its_share() {
        let bench = Bench::new();
        let at = bench.at(&[0.04]);
        let floor = NoiseFloor.floor(at);
        assert!((floor - 0.2 * bench.context.largest_reading).abs() < 1e-12);
        let read = NoiseFloor.transfer(at, floor);
        assert!((read / floor - 2f64.sqrt()).abs() < 1e-12);
        let quotient = (NoiseFloor.transfer(at, floor + 1e-7) - read) / 1e-7;
        assert!((NoiseFloor.transfer_slope(floor, read) - quotient).abs() < 1e-6);
    }
}
