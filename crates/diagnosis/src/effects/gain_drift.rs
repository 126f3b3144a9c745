//! The level drifts through the scan, linearly in time.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct GainDrift;

impl Effect for GainDrift {
    fn id(&self) -> &'static str {
        "gain-drift"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.005, least: -0.95, most: 10.0 }]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.drift = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("the level at one place, over the time of a scan, shows whether it drifts")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the level at the end of the scan is {:.1} ± {:.1} % off that at its beginning",
            100.0 * fitted[0].value,
            100.0 * fitted[0].error
        );
        Said::new([("relative", fitted[0].real())], sentence)
    }
}
