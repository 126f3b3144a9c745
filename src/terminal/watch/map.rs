//! A sheet of readings drawn as colour cells.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::widgets::Widget;

use super::palette::Palette;
use super::sheet::Sheet;

/// Characters of rising level, for terminals without colours.
const SIGNS: [&str; 10] = [" ", ".", ":", "-", "=", "+", "*", "#", "%", "@"];

/// The map of a sheet: two pixels per character, one above the other, so that pixels are about square.
pub(super) struct Map<'s> {
    pub(super) sheet: &'s Sheet,
    /// The reading of the lightest colour.
    pub(super) top: f64,
    pub(super) palette: Palette,
}

impl Widget for Map<'_> {
    fn render(self, area: Rect, buffer: &mut Buffer) {
        let pixels = self.sheet.pixels(area.width.into(), usize::from(area.height) * 2);
        let (rows, columns) = (pixels.len().div_ceil(2), pixels.first().map_or(0, Vec::len));
        // In the middle of its area.
        let left = area.x + (area.width - columns as u16) / 2;
        let above = area.y + (area.height - rows as u16) / 2;
        for (row, pair) in pixels.chunks(2).enumerate() {
            for column in 0..columns {
                let upper = Some(pair[0][column]);
                let lower = pair.get(1).map(|pixels| pixels[column]);
                let cell = &mut buffer[(left + column as u16, above + row as u16)];
                match self.palette {
                    Palette::Plain => {
                        cell.set_symbol(self.sign(upper.flatten(), lower.flatten()));
                    }
                    _ => {
                        cell.set_symbol("▀").set_fg(self.colour(upper)).set_bg(self.colour(lower));
                    }
                }
            }
        }
    }
}

impl Map<'_> {
    /// The colour of a pixel: with a reading, without a reading, or outside the sheet.
    fn colour(&self, pixel: Option<Option<f64>>) -> ratatui::style::Color {
        match pixel {
            Some(Some(reading)) => self.palette.colour(reading / self.top),
            Some(None) => self.palette.unmeasured(),
            None => ratatui::style::Color::Reset,
        }
    }

    fn sign(&self, upper: Option<f64>, lower: Option<f64>) -> &'static str {
        let reading = match (upper, lower) {
            (Some(upper), Some(lower)) => (upper + lower) / 2.0,
            (Some(reading), None) | (None, Some(reading)) => reading,
            (None, None) => return "·",
        };
        let level = (reading / self.top * (SIGNS.len() - 1) as f64).round().max(0.0) as usize;
        SIGNS[level.min(SIGNS.len() - 1)]
    }
}
