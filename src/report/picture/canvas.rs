//! A sheet to draw on, in CSS pixels with fractions, the same for PNG and SVG.

use plotters::backend::DrawingBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle,
};

use super::{PictureError, font};

/// A point on the sheet: x to the right, y down, CSS pixels.
pub(super) type Point = (f64, f64);

/// Backend pixels in a CSS pixel. The backends know whole pixels only, so that everything is drawn this many
/// times larger: an SVG says so in its `viewBox`, a PNG is averaged down, which smooths its edges.
pub(super) const OVERSAMPLING: u32 = 4;

/// Red, green, blue, 0 to 255.
pub(super) type Rgb = (u8, u8, u8);

pub(super) const BLACK: Rgb = (0, 0, 0);
pub(super) const WHITE: Rgb = (255, 255, 255);
/// For helping lines that must stay behind the data.
pub(super) const GREY: Rgb = (150, 150, 150);

/// Where a text lies against its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lies {
    /// To the right of it, centred in height.
    Right,
    /// To the left of it, centred in height.
    Left,
    /// Below it, centred in width.
    Below,
    /// Above it, beginning there.
    AboveRight,
    /// Centred on it, reading upwards.
    Upwards,
}

/// A line's colour and width in CSS pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen {
    pub colour: Rgb,
    pub width: f64,
}

impl Pen {
    fn style(self) -> ShapeStyle {
        let (red, green, blue) = self.colour;
        let width = (self.width * f64::from(OVERSAMPLING)).round().max(1.0);
        RGBColor(red, green, blue).stroke_width(width as u32)
    }
}

/// The style that fills with a colour.
fn filling((red, green, blue): Rgb) -> ShapeStyle {
    RGBColor(red, green, blue).filled()
}

/// The sheet.
pub(in crate::report) struct Canvas<'a, B> {
    backend: &'a mut B,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// A white sheet over the whole of the backend.
    pub fn new(backend: &'a mut B) -> Result<Self, PictureError> {
        font::register();
        let (width, height) = backend.get_size();
        let whole = (width as i32, height as i32);
        backend.draw_rect((0, 0), whole, &filling(WHITE), true).map_err(drawing)?;
        Ok(Self { backend })
    }

    /// A line through the points.
    pub fn line(&mut self, points: &[Point], pen: Pen) -> Result<(), PictureError> {
        if points.len() < 2 {
            return Ok(());
        }
        self.backend.draw_path(points.iter().map(|&p| device(p)), &pen.style()).map_err(drawing)
    }

    /// A line of dashes: `pattern` gives the lengths of dash, gap, dash, gap ... in CSS pixels; none is a solid
    /// line.
    pub fn dashed(
        &mut self,
        points: &[Point],
        pattern: &[f64],
        pen: Pen,
    ) -> Result<(), PictureError> {
        if pattern.is_empty() {
            return self.line(points, pen);
        }
        dashes(points, pattern).iter().try_for_each(|&(from, to)| self.line(&[from, to], pen))
    }

    /// A closed outline.
    pub fn outline(&mut self, points: &[Point], pen: Pen) -> Result<(), PictureError> {
        // Past the first corner, so that the joint at the start is as sharp as the others.
        let closed: Vec<Point> = points.iter().chain(points.iter().take(2)).copied().collect();
        self.line(&closed, pen)
    }

    /// A filled polygon.
    pub fn fill(&mut self, points: &[Point], colour: Rgb) -> Result<(), PictureError> {
        let points = points.iter().map(|&p| device(p));
        self.backend.fill_polygon(points, &filling(colour)).map_err(drawing)
    }

    /// A text of the given size (height of a line, CSS pixels).
    pub fn text(
        &mut self,
        text: &str,
        at: Point,
        size: f64,
        lies: Lies,
    ) -> Result<(), PictureError> {
        let (h_pos, v_pos) = match lies {
            Lies::Right => (HPos::Left, VPos::Center),
            Lies::Left => (HPos::Right, VPos::Center),
            Lies::Below => (HPos::Center, VPos::Top),
            Lies::AboveRight => (HPos::Left, VPos::Bottom),
            Lies::Upwards => (HPos::Center, VPos::Center),
        };
        let turn =
            if lies == Lies::Upwards { FontTransform::Rotate270 } else { FontTransform::None };
        let size_px = size * f64::from(OVERSAMPLING);
        let mut style = FontDesc::new(FontFamily::Name(font::FAMILY), size_px, FontStyle::Normal)
            .transform(turn)
            .color(&plotters::style::BLACK);
        style.pos = Pos::new(h_pos, v_pos);
        // What a scan is called is up to its user; XML has no place for control characters.
        let printable: String =
            text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        self.backend.draw_text(&printable, &style, device(at)).map_err(drawing)
    }

    /// A picture of backend pixels, three bytes each, with its upper left corner at a point.
    pub fn image(
        &mut self,
        at: Point,
        size_px: (u32, u32),
        rgb: &[u8],
    ) -> Result<(), PictureError> {
        self.backend.blit_bitmap(device(at), size_px, rgb).map_err(drawing)
    }
}

/// A point in backend pixels.
fn device((x, y): Point) -> (i32, i32) {
    let scale = f64::from(OVERSAMPLING);
    ((x * scale).round() as i32, (y * scale).round() as i32)
}

fn drawing(error: impl std::error::Error) -> PictureError {
    PictureError::Drawing(error.to_string())
}

/// The dashes along a line, each from one point to another.
fn dashes(points: &[Point], pattern: &[f64]) -> Vec<(Point, Point)> {
    let mut found = Vec::new();
    let (mut part, mut left) = (0, pattern[0]);
    for pair in points.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let along = |done: f64| {
            let fraction = done / length;
            (from.0 + fraction * (to.0 - from.0), from.1 + fraction * (to.1 - from.1))
        };
        let mut done = 0.0;
        while done < length {
            let step = left.min(length - done);
            if part % 2 == 0 {
                found.push((along(done), along(done + step)));
            }
            done += step;
            left -= step;
            if left <= 0.0 {
                part = (part + 1) % pattern.len();
                left = pattern[part];
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_go_on_round_a_corner() {
        let found = dashes(&[(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)], &[4.0, 2.0]);
        assert_eq!(found, [((0.0, 0.0), (4.0, 0.0)), ((5.0, 1.0), (5.0, 5.0))]);
    }
}
