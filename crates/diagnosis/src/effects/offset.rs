//! The robot's origin is not the array's: in the array's frame it stands beside it.
//!
//! A fraction of a millimetre is what careful setting-up leaves and belongs to the registration; this is more.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Offset;

impl Effect for Offset {
    fn id(&self) -> &'static str {
        "offset"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
            Parameter { neutral: 0.0, scale: 0.05, least: -20.0, most: 20.0 },
        ]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.offset_m.copy_from_slice(&[1e-3 * values[0], 1e-3 * values[1], 1e-3 * values[2]]);
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("`fieldgap rig find-axis` shows where the array's middle stands")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        let sentence = format!(
            "the robot's origin stands {:.2} ± {:.2} mm along x, {:.2} ± {:.2} along y and {:.2} ± {:.2} along z from the array's",
            x.value, x.error, y.value, y.error, z.value, z.error
        );
        Said::new([("x_mm", x.real()), ("y_mm", y.real()), ("z_mm", z.real())], sentence)
    }
}
