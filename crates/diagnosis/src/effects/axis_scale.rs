//! Steps a millimetre are wrong: a commanded millimetre is truly this long, about the array's centre.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct AxisScale;

impl Effect for AxisScale {
    fn id(&self) -> &'static str {
        "axis-scale"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 1.0, scale: 0.001, least: 0.8, most: 1.25 },
            Parameter { neutral: 1.0, scale: 0.001, least: 0.8, most: 1.25 },
            Parameter { neutral: 1.0, scale: 0.001, least: 0.8, most: 1.25 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.scale.copy_from_slice(values);
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a rule beside the robot shows how far it goes")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        let sentence = format!(
            "a commanded millimetre is {:.4} ± {:.4} mm along x, {:.4} ± {:.4} along y and {:.4} ± {:.4} along z",
            x.value, x.error, y.value, y.error, z.value, z.error
        );
        Said::new([("x", x.real()), ("y", y.real()), ("z", z.real())], sentence)
    }
}
