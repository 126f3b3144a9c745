//! The array is larger or smaller than modelled; the delays were computed for the modelled one.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Pitch;

impl Effect for Pitch {
    fn id(&self) -> &'static str {
        "pitch"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.85, most: 1.18 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.95], vec![1.05]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.pitch_ratio = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("callipers show how far apart the elements stand")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the elements stand {:.4} ± {:.4} times as far apart as modelled",
            fitted[0].value, fitted[0].error
        );
        Said::new([("ratio", fitted[0].real())], sentence)
    }
}
