//! The array's plane is tilted against the scan's axes about its centre: first about x, then about y.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct ArrayTilt;

impl Effect for ArrayTilt {
    fn id(&self) -> &'static str {
        "array-tilt"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 },
            Parameter { neutral: 0.0, scale: 0.002, least: -0.5, most: 0.5 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.tilt_rad = [values[0], values[1]];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a dial gauge on the robot, led along the array's face, shows its tilt")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [x, y] = [fitted[0], fitted[1]];
        let sentence = format!(
            "the array is tilted by {:.2} ± {:.2} degrees about x and {:.2} ± {:.2} about y",
            x.value.to_degrees(),
            x.error.to_degrees(),
            y.value.to_degrees(),
            y.error.to_degrees()
        );
        Said::new([("about_x_rad", x.real()), ("about_y_rad", y.real())], sentence)
    }
}
