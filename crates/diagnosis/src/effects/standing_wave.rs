//! Sound bounces between receiver and array: p (1 + Γ exp(2 i k z)), a ripple of half a wavelength in z.

use num_complex::Complex64;

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::FittedParameter;
use crate::supposed::Supposed;

/// The effect.
pub(super) struct StandingWave;

impl Effect for StandingWave {
    fn id(&self) -> &'static str {
        "standing-wave"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
            Parameter { neutral: 0.0, scale: 0.005, least: -1.5, most: 1.5 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.standing = Complex64::new(values[0], values[1]);
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [re, im] = [fitted[0], fitted[1]];
        let coefficient = FittedParameter::Complex {
            value: [re.value, im.value],
            standard_error: [re.error, im.error],
        };
        let sentence = format!(
            "sound that went back to the array returns with {:.1} % of the pressure",
            100.0 * re.value.hypot(im.value)
        );
        Said::new([("coefficient", coefficient)], sentence)
    }
}
