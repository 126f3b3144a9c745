//! The receiver's sensitivity falls with the angle of arrival, counted from its axis (it looks at the array): a Gaussian
//! in the angle, -6 dB at the given one.
//!
//! It is fitted as the inverse square of that angle, which is zero for an even receiver.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct ReceiverDirectivity;

impl Effect for ReceiverDirectivity {
    fn id(&self) -> &'static str {
        "receiver-directivity"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: 0.0, most: 60.0 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.1], vec![2.0]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.reception_half_rad = 1.0 / values[0].max(0.0).sqrt();
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("the receiver, turned where it stands, shows its lobe")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let half_rad = 1.0 / fitted[0].value.max(1e-6).sqrt();
        let half_deg =
            fitted[0].map(half_rad.to_degrees(), 0.5 * half_rad.to_degrees() * half_rad * half_rad);
        let sentence = format!(
            "the receiver hears half (-6 dB) at {:.1} ± {:.1} degrees from its axis",
            half_deg.value, half_deg.error
        );
        Said::new([("half_angle_deg", half_deg.real())], sentence)
    }
}
