//! The robot's y axis leans towards x instead of standing square on it.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Skew;

impl Effect for Skew {
    fn id(&self) -> &'static str {
        "skew"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 }]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.skew_rad = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a square held to the robot's axes shows their angle")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the robot's y axis leans by {:.2} ± {:.2} degrees towards x",
            fitted[0].value.to_degrees(),
            fitted[0].error.to_degrees()
        );
        Said::new([("rad", fitted[0].real())], sentence)
    }
}
