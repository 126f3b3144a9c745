//! The reading trails the motion: it is that of where the nozzle was a moment ago.
//!
//! Unlike play it grows with speed and acts along every axis.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Lag;

impl Effect for Lag {
    fn id(&self) -> &'static str {
        "lag"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.001, least: 0.0, most: 1.0 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![5e-3], vec![2.5e-2]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.lag_s = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a burst at rest shows how late the receiver reads it")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "readings trail the motion by {:.1} ± {:.1} ms",
            1e3 * fitted[0].value,
            1e3 * fitted[0].error
        );
        Said::new([("s", fitted[0].real())], sentence)
    }
}
