//! The speed of sound varies linearly through the field: c(x) = c (1 + g·x).
//!
//! A kelvin changes it by 0.17 %. Straight rays; their bending lengthens a path only by the order of (g d)²/24.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct TemperatureGradient;

impl Effect for TemperatureGradient {
    fn id(&self) -> &'static str {
        "temperature-gradient"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.gradient_per_m.copy_from_slice(values);
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some(
            "two thermometers, one at the array and one where the scan ends, show how the air's temperature changes",
        )
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        // dc/c = dT / 2T at 293 K.
        let kelvin_m = |g: f64| g * 2.0 * 293.15;
        let sentence = format!(
            "the speed of sound changes through the field by {:.1} % a metre along x, {:.1} along y, {:.1} along z: \
             {:.0}, {:.0} and {:.0} kelvin a metre",
            100.0 * x.value,
            100.0 * y.value,
            100.0 * z.value,
            kelvin_m(x.value),
            kelvin_m(y.value),
            kelvin_m(z.value)
        );
        Said::new([("gx", x.real()), ("gy", y.real()), ("gz", z.real())], sentence)
    }
}
