//! A plane above the field, parallel to the array, returns an image of it (Pierce, *Acoustics*, section 1-4).
//!
//! The cost has a minimum every half wavelength of height: all heights are tried, the coefficient solved for at each.

use num_complex::Complex64;

use super::{Choice, Context, Effect, Fitted, Parameter, Said, Search};
use crate::FittedParameter;
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Reflection;

impl Effect for Reflection {
    fn id(&self) -> &'static str {
        "reflection"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.05, least: 0.0, most: 1500.0 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
        ]
    }

    fn search(&self) -> Search {
        Search::Heights
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.mirror = Some((1e-3 * values[0], Complex64::new(values[1], values[2])));
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [height, re, im] = [fitted[0], fitted[1], fitted[2]];
        let coefficient = FittedParameter::Complex {
            value: [re.value, im.value],
            standard_error: [re.error, im.error],
        };
        let sentence = format!(
            "a plane at {:.2} ± {:.2} mm above the array returns {:.1} % of the pressure",
            height.value,
            height.error,
            100.0 * re.value.hypot(im.value)
        );
        Said::new([("height_mm", height.real()), ("coefficient", coefficient)], sentence)
    }
}
