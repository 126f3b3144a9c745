//! The receiver averages the pressure over its face, a disc parallel to the array.
//!
//! A plane wave from an angle θ is heard as 2 J₁(x)/x with x = k a sin θ, as a radiating piston is (reciprocity). It is fitted
//! as the squared radius, in which it is linear when small.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Aperture;

impl Effect for Aperture {
    fn id(&self) -> &'static str {
        "aperture"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.5, least: 0.0, most: 150.0 }]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![16.0]]
    }

    fn suppose(
        &self,
        values: &[f64],
        _choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.face_radius_m = 1e-3 * values[0].max(0.0).sqrt();
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some("callipers show how wide an element's opening is")
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let radius = fitted[0].value.max(1e-6).sqrt();
        let radius = fitted[0].map(radius, 0.5 / radius);
        let sentence = format!(
            "the receiver averages over a face of {:.2} ± {:.2} mm radius",
            radius.value, radius.error
        );
        Said::new([("radius_mm", radius.real())], sentence)
    }
}
