//! The elements' lobes are wider or narrower than modelled.
//!
//! Either every angle of the directivity is stretched, or the face is smaller, which stretches a piston's lobe in the sine of
//! the angle: both are tried.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::Supposed;

/// The effect.
pub(super) struct Directivity;

impl Effect for Directivity {
    fn id(&self) -> &'static str {
        "directivity"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.01, least: 0.4, most: 2.5 }]
    }

    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1)]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.8], vec![1.3]]
    }

    fn suppose(
        &self,
        values: &[f64],
        choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.width_ratio = values[0];
        supposed.widened_by_face = *choice == Choice::Law(1);
    }

    fn shown_by(&self) -> Option<&'static str> {
        Some(
            "one element alone, turned before the receiver, shows its lobe (`fieldgap characterize`)",
        )
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "the elements' lobes are {:.3} ± {:.3} times as wide as modelled",
            fitted[0].value, fitted[0].error
        );
        Said::new([("width_ratio", fitted[0].real())], sentence)
    }
}
