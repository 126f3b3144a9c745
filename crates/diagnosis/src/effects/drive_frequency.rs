//! The drive is off its nominal frequency, as a clock of its own would be; delays are kept in seconds.
//!
//! Wavenumber and phases both scale with the frequency. From magnitudes alone this is nearly a change of sound speed: a scan
//! tells the two apart only by how far the focus moves against how much the pattern's scale changes.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct DriveFrequency;

impl Effect for DriveFrequency {
    fn id(&self) -> &'static str {
        "drive-frequency"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.98], vec![1.02]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.frequency_ratio = values[0];
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("a counter on the drive shows its frequency")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, context: &Context) -> Said {
        let nominal_hz = context.believed.frequency_hz;
        let sentence = format!(
            "the carrier is at {:.1} ± {:.1} Hz, not {nominal_hz:.1} Hz",
            nominal_hz * fitted[0].value,
            nominal_hz * fitted[0].error
        );
        Said::new([("ratio", fitted[0].real())], sentence)
    }
}
