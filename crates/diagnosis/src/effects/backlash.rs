//! Play between motor and carriage along x: the nozzle trails by half of it, to either side of where it is believed.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Backlash;

impl Effect for Backlash {
    fn id(&self) -> &'static str {
        "backlash"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: -4.0, most: 4.0 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.3], vec![-0.3]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.backlash_m = 1e-3 * values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a dial gauge against the robot, come from either side, shows its play")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the carriage has {:.2} ± {:.2} mm of play along x",
            fitted[0].value, fitted[0].error
        );
        Said::new([("mm", fitted[0].real())], sentence)
    }
}
