//! The robot's axes are turned about z, right-handed, about the array's centre.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Rotation;

impl Effect for Rotation {
    fn id(&self) -> &'static str {
        "rotation"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.002, least: -0.8, most: 0.8 }]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.turn_rad = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a straight edge along a row of elements, followed by the robot, shows the angle")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the robot's axes are turned by {:.2} ± {:.2} degrees about z",
            fitted[0].value.to_degrees(),
            fitted[0].error.to_degrees()
        );
        Said::new([("rad", fitted[0].real())], sentence)
    }
}
