//! Soft compression at high level: v / √(1 + (v/level)²), which loses 3 dB where v = level.
//!
//! It is fitted as the squared ratio of the largest reading to the level, which is zero for a straight receiver. The
//! noise that came in before is compressed with the signal.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Saturation;

impl Effect for Saturation {
    fn id(&self) -> &'static str {
        "saturation"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: 0.0, most: 400.0 }]
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

    fn suppose(&self, values: &[f64], choice: &Choice, context: &Context, supposed: &mut Supposed) {
        supposed.share_before_receiver = *choice == Choice::Law(1);
        supposed.saturation = context.largest_reading / values[0].max(0.0).sqrt();
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some(
            "the level at one place, at full and at half drive, shows whether the receiver follows",
        )
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, context: &Context) -> Said {
        let ratio = fitted[0].value.max(1e-9).sqrt();
        let level = context.largest_reading / ratio;
        let level = fitted[0].map(level, 0.5 * level / (ratio * ratio));
        let sentence = format!(
            "the receiver compresses: at {:.3} ± {:.3} {} it has lost 3 dB",
            level.value, level.error, context.unit
        );
        Said::new([("level", level.real())], sentence)
    }
}
