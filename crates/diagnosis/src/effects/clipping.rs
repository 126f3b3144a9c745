//! The converter's full scale cuts the peaks.
//!
//! It is fitted as a share of the largest reading, at which the readings pile up.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Clipping;

impl Effect for Clipping {
    fn id(&self) -> &'static str {
        "clipping"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.2, scale: 0.005, least: 0.05, most: 1.2 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.999], vec![0.9]]
    }

    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        context: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.full_scale = context.largest_reading * values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some(
            "the level at the focus, at full and at half drive, shows whether the receiver follows",
        )
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, context: &Context) -> Said {
        let level =
            fitted[0].map(context.largest_reading * fitted[0].value, context.largest_reading);
        let sentence =
            format!("readings are cut at {:.3} ± {:.3} {}", level.value, level.error, context.unit);
        Said::new([("level", level.real())], sentence)
    }
}
