//! From a residual in standard deviations of the noise to a colour, over more than two orders of magnitude.

use super::diverging_scale::DivergingScale;
use fieldgap_canvas::Rgb;

/// Residuals below this are about linear in colour, standard deviations: noise alone stays nearly white.
const LINEAR_SIGMA: f64 = 2.0;

/// Where the colours end, standard deviations. The same on every picture, so that heights can be compared.
pub(crate) const REACH_SIGMA: f64 = 500.0;

/// Values with a number beside the colour bar, with both signs.
const MARKED_SIGMA: [f64; 5] = [3.0, 10.0, 30.0, 100.0, 300.0];

/// Colours from white to dark.
const COLOURS: DivergingScale = DivergingScale { reach: 1.0 };

/// The place of a residual on the scale: 0 for none, -1 and 1 at the ends and beyond. The inverse hyperbolic sine is linear near zero
/// and logarithmic beyond, with either sign.
pub(super) fn along(residual_sigma: f64) -> f64 {
    let reach = (REACH_SIGMA / LINEAR_SIGMA).asinh();
    ((residual_sigma / LINEAR_SIGMA).asinh() / reach).clamp(-1.0, 1.0)
}

/// The colour of a residual.
pub(super) fn colour(residual_sigma: f64) -> Rgb {
    COLOURS.colour(along(residual_sigma))
}

/// The colour at a place of the scale.
pub(super) fn colour_along(along: f64) -> Rgb {
    COLOURS.colour(along)
}

/// Black or white, whichever contrasts with the colour of a residual.
pub(super) fn contrast(residual_sigma: f64) -> Rgb {
    COLOURS.contrast(along(residual_sigma))
}

/// The places of the scale that have a number, and the numbers.
pub(super) fn marks() -> Vec<(f64, String)> {
    let above = MARKED_SIGMA.iter().map(|&sigma| (along(sigma), format!("{sigma}")));
    let below = MARKED_SIGMA.iter().map(|&sigma| (along(-sigma), format!("\u{2212}{sigma}")));
    below.chain([(0.0, "0".to_owned())]).chain(above).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_residuals_differ_and_noise_is_nearly_white() {
        assert_eq!(colour(0.0), (250, 250, 250));
        assert!(along(1.0) < 0.1, "{}", along(1.0));
        for (smaller, larger) in [(3.0, 10.0), (10.0, 30.0), (30.0, 100.0), (100.0, 300.0)] {
            assert!(along(larger) - along(smaller) > 0.15, "{smaller} and {larger}");
            assert_ne!(colour(-smaller), colour(-larger));
        }
        assert_eq!(colour(1e6), colour(REACH_SIGMA));
    }
}
