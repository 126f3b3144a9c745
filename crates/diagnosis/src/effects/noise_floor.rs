//! A floor that the detector adds in power: √(v² + level²).
//!
//! It is fitted as the squared ratio to the largest reading, which is zero for none; what silence reads says it best.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct NoiseFloor;

impl Effect for NoiseFloor {
    fn id(&self) -> &'static str {
        "noise-floor"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 1e-05, least: 0.0, most: 1.0 }]
    }

    /// Noise in proportion to the level behind the detector, or before it: nothing else tells which.
    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1)]
    }

    fn starts(&self, context: &Context) -> Vec<Vec<f64>> {
        match (context.silent_floor / context.largest_reading).powi(2) {
            0.0 => vec![vec![1e-7], vec![1e-6], vec![1e-4], vec![1e-2]],
            in_silence => vec![vec![in_silence]],
        }
    }

    /// It changes how readings scatter, too, which no slope says.
    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn suppose(&self, values: &[f64], choice: &Choice, context: &Context, supposed: &mut Supposed) {
        supposed.share_before_receiver = *choice == Choice::Law(1);
        supposed.floor = context.largest_reading * values[0].max(0.0).sqrt();
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, context: &Context) -> Said {
        let ratio = fitted[0].value.max(1e-12).sqrt();
        let level =
            fitted[0].map(context.largest_reading * ratio, 0.5 * context.largest_reading / ratio);
        let sentence = format!(
            "a floor of {:.4} ± {:.4} {} is added in power to every reading",
            level.value, level.error, context.unit
        );
        Said::new([("level", level.real())], sentence)
    }
}
