//! Random phases along the paths: the coherent part fades with distance, and a speckle is added that differs from
//! reading to reading.
//!
//! The phase of a path of length d through many eddies is normal with variance s² d (Ostashev and Wilson, *Acoustics in Moving
//! Inhomogeneous Media*, chapter 7): coherent amplitudes fade as exp(-s² d/2), and the power that they lose is the
//! speckle's. It changes the readings' variance more than their mean. Where the phases of the paths change by little and each by
//! itself, the speckle stands across what the paths bring, and a focus hardly flickers; where sound is scattered many times it
//! is alike in both quadratures. Both are tried.

use super::{Choice, Context, Effect, Fitted, Parameter, Said};
use crate::supposed::{Speckle, Supposed};

/// The effect.
pub(super) struct Turbulence;

/// The kind of speckle that a choice stands for.
pub(crate) fn speckle(choice: &Choice) -> Speckle {
    match choice {
        Choice::Law(1) => Speckle::Circular,
        _ => Speckle::OfPaths,
    }
}

impl Effect for Turbulence {
    fn id(&self) -> &'static str {
        "turbulence"
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.05, least: 0.0, most: 6.0 }]
    }

    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1)]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        // Its square acts: at zero there is no slope to follow.
        vec![vec![0.05], vec![0.2], vec![1.0]]
    }

    fn begins_flat(&self, _believed: &Context) -> bool {
        true
    }

    fn suppose(
        &self,
        values: &[f64],
        choice: &Choice,
        _believed: &Context,
        supposed: &mut Supposed,
    ) {
        supposed.turbulence = values[0];
        supposed.speckle = speckle(choice);
    }

    fn say(&self, fitted: &[Fitted], _choice: &Choice, _believed: &Context) -> Said {
        let sentence = format!(
            "turbulent air turns phases at random by {:.2} ± {:.2} rad over one metre",
            fitted[0].value, fitted[0].error
        );
        Said::new([("rad_per_sqrt_m", fitted[0].real())], sentence)
    }
}
