//! The font of the pictures. It is embedded, so that pictures are the same on every machine.

use std::sync::OnceLock;

use plotters::style::{FontStyle, register_font};

/// A subset of DejaVu Sans (Bitstream Vera licence, `font/LICENSE.txt`): Latin-1, Greek, the signs of
/// mathematics. Other characters come out as empty boxes in PNG; SVG viewers use their own fonts.
static DEJAVU_SANS: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");

/// Name under which the font is known; in an SVG it is the viewer's list of choices, the nearest first.
pub(super) const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

/// Makes the font known to the drawing library, once.
pub(super) fn register() {
    static REGISTERED: OnceLock<()> = OnceLock::new();
    REGISTERED.get_or_init(|| {
        register_font(FAMILY, FontStyle::Normal, DEJAVU_SANS)
            .unwrap_or_else(|_| unreachable!("the embedded font is a valid TrueType file"));
    });
}
