//! Attenuation along each path beyond the model: exp(-α d), α = db_per_m ln 10 / 20.
//!
//! Air at 20 °C and 50 % humidity takes 1.3 dB/m at 40 kHz (ISO 9613-1). A believed decay that is too strong shows as a
//! value below zero.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Absorption;

impl Effect for Absorption {
    fn id(&self) -> &'static str {
        "absorption"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.5, least: -40.0, most: 80.0 }]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.attenuation_db_m = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a thermometer and a hygrometer show what the air absorbs")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "each path loses {:.2} ± {:.2} dB a metre more than the model says (air at 20 °C and 50 % humidity: 1.3)",
            fitted[0].value, fitted[0].error
        );
        Said::new([("db_per_m", fitted[0].real())], sentence)
    }
}
