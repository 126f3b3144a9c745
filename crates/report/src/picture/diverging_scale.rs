//! From a difference to a colour.

use fieldgap_canvas::{BLACK, Rgb, WHITE};

/// White where there is no difference, through blue to dark below zero and through orange to dark above: a pair that the
/// colour-blind tell apart, as light on one side as on the other. Without colour at all, signs say which side it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DivergingScale {
    /// The size of a difference from which on the colour stays the darkest; finite, above zero.
    pub reach: f64,
}

/// Colours at a half and at the whole of the reach.
const BELOW: [Rgb; 2] = [(86, 160, 211), (5, 48, 97)];
const ABOVE: [Rgb; 2] = [(233, 148, 72), (127, 39, 4)];
const NOTHING: Rgb = (250, 250, 250);

impl DivergingScale {
    /// The colour of a difference.
    pub fn colour(&self, difference: f64) -> Rgb {
        let side = if difference < 0.0 { BELOW } else { ABOVE };
        let along = 2.0 * (difference.abs() / self.reach).clamp(0.0, 1.0);
        if along < 1.0 {
            mixed(NOTHING, side[0], along)
        } else {
            mixed(side[0], side[1], along - 1.0)
        }
    }

    /// Black or white, whichever contrasts with the colour of a difference.
    pub fn contrast(&self, difference: f64) -> Rgb {
        if difference.abs() < 0.7 * self.reach { BLACK } else { WHITE }
    }
}

/// The colour at a share of the way from one to another.
fn mixed(from: Rgb, to: Rgb, share: f64) -> Rgb {
    let channel = |from: u8, to: u8| {
        (f64::from(from) + share * (f64::from(to) - f64::from(from))).round() as u8
    };
    (channel(from.0, to.0), channel(from.1, to.1), channel(from.2, to.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rec. 709 luma, enough to compare by.
    fn luma((red, green, blue): Rgb) -> f64 {
        0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
    }

    #[test]
    fn both_sides_darken_all_the_way_and_alike() {
        let scale = DivergingScale { reach: 5.0 };
        let side = |sign: f64| -> Vec<f64> {
            (0..=20).map(|step| luma(scale.colour(sign * f64::from(step) / 4.0))).collect()
        };
        let (below, above) = (side(-1.0), side(1.0));
        for side in [&below, &above] {
            assert!(side.windows(2).all(|pair| pair[1] < pair[0]), "{side:?}");
        }
        let apart = below.iter().zip(&above).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 25.0, "{below:?} {above:?}");
    }

    #[test]
    fn beyond_the_reach_the_colour_stays() {
        let scale = DivergingScale { reach: 5.0 };
        assert_eq!(scale.colour(50.0), scale.colour(5.0));
        assert_eq!(scale.colour(-50.0), BELOW[1]);
        assert_eq!(scale.colour(0.0), NOTHING);
    }
}
