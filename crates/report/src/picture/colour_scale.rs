//! From a reading to a colour.

use plotters::style::Color;
use plotters::style::colors::colormaps::ViridisRGB;

use fieldgap_canvas::{BLACK, Rgb, WHITE};

/// From zero to a top, through viridis: even steps look even, and its lightness only rises, so that it
/// stays readable in print without colour and to the colour-blind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ColourScale {
    /// The reading of the lightest colour; finite, above zero.
    pub top: f64,
}

impl ColourScale {
    /// The colour of a reading; those below zero and above the top take the colour of the end.
    pub fn colour(&self, reading: f64) -> Rgb {
        ViridisRGB::get_color((reading / self.top).clamp(0.0, 1.0)).rgb()
    }

    /// Black or white, whichever contrasts with the colour of a reading.
    pub fn contrast(&self, reading: f64) -> Rgb {
        if lightness(self.colour(reading)) > 55.0 { BLACK } else { WHITE }
    }
}

/// CIE 1976 lightness L* of an sRGB colour, 0 (black) to 100 (white); CIE 15:2004 and IEC 61966-2-1.
fn lightness((red, green, blue): Rgb) -> f64 {
    let linear = |channel: u8| {
        let value = f64::from(channel) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    let luminance = 0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
    if luminance > 216.0 / 24389.0 {
        116.0 * luminance.cbrt() - 16.0
    } else {
        luminance * 24389.0 / 27.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_is_that_of_known_colours() {
        assert!(lightness(BLACK).abs() < 1e-9 && (lightness(WHITE) - 100.0).abs() < 1e-6);
        // sRGB (119, 119, 119) is the grey of L* = 50.
        assert!((lightness((119, 119, 119)) - 50.0).abs() < 0.1);
    }

    #[test]
    fn lightness_rises_all_the_way_and_evenly() {
        let scale = ColourScale { top: 20.0 };
        let along: Vec<f64> =
            (0..=20).map(|step| lightness(scale.colour(f64::from(step)))).collect();
        let rises: Vec<f64> = along.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(rises.iter().all(|rise| (2.0..6.0).contains(rise)), "{rises:?}");
        assert!(along[0] < 20.0 && along[20] > 88.0, "{along:?}");
    }

    #[test]
    fn beyond_the_ends_the_end_colour_stands() {
        let scale = ColourScale { top: 2.0 };
        assert_eq!(scale.colour(-1.0), scale.colour(0.0));
        assert_eq!(scale.colour(9.0), scale.colour(2.0));
        assert_eq!((scale.contrast(0.0), scale.contrast(2.0)), (WHITE, BLACK));
    }
}
