//! The on-axis decay follows another law, d^-exponent: 1 is spherical, 0.5 cylindrical, 0 none.
//!
//! It stands in the place of the simulator's own law, fitted or spherical.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;
use fieldgap_acoustics::transducer::OnAxis;

/// The effect.
pub(super) struct Spreading;

impl Effect for Spreading {
    fn id(&self) -> &'static str {
        "spreading"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.02, least: -1.0, most: 4.0 }]
    }

    fn begins_flat(&self, believed: &Context) -> bool {
        believed.believed.transducer().on_axis() != OnAxis::Spherical
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.spreading = Some(values[0]);
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some(
            "one element alone, scanned along its axis, shows how its pressure falls (`fieldgap characterize`)",
        )
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "pressure falls with distance as d^-{:.3} ± {:.3} (1 is spherical)",
            fitted[0].value, fitted[0].error
        );
        Said::new([("exponent", fitted[0].real())], sentence)
    }
}
