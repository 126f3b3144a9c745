//! A sheet to draw on, in CSS pixels with fractions, the same for PNG and SVG.

use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle,
};

use super::sheet::Sheet;
use super::{CanvasError, font};

/// A point on the sheet: x to the right, y down, CSS pixels.
pub type Point = (f64, f64);

/// Backend pixels in a CSS pixel, unless a resolution is asked for. The backends know whole pixels only, so that everything is drawn this many
/// times larger: an SVG says so in its `viewBox`, a PNG is averaged down, which smooths its edges.
pub const OVERSAMPLING: u32 = 4;

/// Red, green, blue, 0 to 255.
pub type Rgb = (u8, u8, u8);

/// The colour of lines and letters.
pub const BLACK: Rgb = (0, 0, 0);
/// The colour of the sheet.
pub const WHITE: Rgb = (255, 255, 255);
/// For auxiliary lines, which stay behind the data.
pub const GREY: Rgb = (150, 150, 150);

/// How a text is aligned with its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
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
pub struct Pen {
    /// Its colour.
    pub colour: Rgb,
    /// Its width, CSS pixels.
    pub width: f64,
}

impl Pen {
    fn style(self, scale: f64) -> ShapeStyle {
        let (red, green, blue) = self.colour;
        let width = (self.width * scale).round().max(1.0);
        RGBColor(red, green, blue).stroke_width(width as u32)
    }
}

/// The style that fills with a colour.
fn filling((red, green, blue): Rgb) -> ShapeStyle {
    RGBColor(red, green, blue).filled()
}

/// Corrections that give the text of a backend the requested size and height.
#[derive(Debug, Clone, Copy)]
struct TextFit {
    /// Factor on the size.
    pub size: f64,
    /// Downward shift, in units of the size.
    pub drop: f64,
}

impl TextFit {
    /// The SVG backend takes 1.24 of the font's em for the size and centres lower case letters.
    pub const SVG: Self = Self { size: 1.0, drop: 0.0 };
    /// The bitmap backend takes the font's ascent and descent, 1.164 em, for the size, and sets the base line half of
    /// it below the top.
    pub const BITMAP: Self = Self { size: 1.164 / 1.24, drop: 0.15 };
}

/// The sheet.
pub struct Canvas<'s, 'a> {
    sheet: &'s mut Sheet<'a>,
    text_fit: TextFit,
    /// Backend pixels in a CSS pixel.
    scale: f64,
}

impl<'s, 'a> Canvas<'s, 'a> {
    /// A white sheet, with so many of its pixels in a CSS pixel.
    pub(super) fn new(sheet: &'s mut Sheet<'a>, scale: f64) -> Result<Self, CanvasError> {
        font::register();
        sheet.fill_all(&filling(WHITE))?;
        let text_fit = match sheet {
            Sheet::Bitmap(_) => TextFit::BITMAP,
            Sheet::Svg(_) => TextFit::SVG,
        };
        Ok(Self { sheet, text_fit, scale })
    }

    /// Backend pixels in a CSS pixel.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A point in backend pixels.
    fn device(&self, (x, y): Point) -> (i32, i32) {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    /// A straight line.
    pub fn line(&mut self, from: Point, to: Point, pen: Pen) -> Result<(), CanvasError> {
        let (from, to) = (self.device(from), self.device(to));
        self.sheet.line(from, to, &pen.style(self.scale))
    }

    /// A line of dashes through the points: `pattern` gives the lengths of dash, gap, dash, gap ... in CSS
    /// pixels; an empty one draws a solid line.
    pub fn dashed(
        &mut self,
        points: &[Point],
        pattern: &[f64],
        pen: Pen,
    ) -> Result<(), CanvasError> {
        let solid = || points.windows(2).map(|pair| (pair[0], pair[1])).collect();
        let parts = if pattern.is_empty() { solid() } else { dashes(points, pattern) };
        parts.into_iter().try_for_each(|(from, to)| self.line(from, to, pen))
    }

    /// The closed outline of a convex shape whose corners go clockwise on the sheet.
    pub fn outline(&mut self, corners: &[Point], pen: Pen) -> Result<(), CanvasError> {
        // As one polygon with a slit from its outer to its inner border: the backends would leave the joints
        // of a closed path open, or cut them.
        let mut ring = grown(corners, pen.width / 2.0);
        ring.push(ring[0]);
        let mut inner = grown(corners, -pen.width / 2.0);
        inner.push(inner[0]);
        ring.extend(inner.into_iter().rev());
        self.fill(&ring, pen.colour)
    }

    /// A filled polygon.
    pub fn fill(&mut self, points: &[Point], colour: Rgb) -> Result<(), CanvasError> {
        let points: Vec<(i32, i32)> = points.iter().map(|&p| self.device(p)).collect();
        self.sheet.polygon(points, &filling(colour))
    }

    /// A text of the given size (height of a line, CSS pixels).
    pub fn text(
        &mut self,
        text: &str,
        at: Point,
        size: f64,
        align: Align,
    ) -> Result<(), CanvasError> {
        let (h_pos, v_pos) = match align {
            Align::Right => (HPos::Left, VPos::Center),
            Align::Left => (HPos::Right, VPos::Center),
            Align::Below => (HPos::Center, VPos::Top),
            Align::AboveRight => (HPos::Left, VPos::Bottom),
            Align::Upwards => (HPos::Center, VPos::Center),
        };
        let turn =
            if align == Align::Upwards { FontTransform::Rotate270 } else { FontTransform::None };
        let drop = size * self.text_fit.drop;
        let at = if align == Align::Upwards { (at.0 + drop, at.1) } else { (at.0, at.1 + drop) };
        let size_px = size * self.text_fit.size * self.scale;
        let mut style = FontDesc::new(FontFamily::Name(font::FAMILY), size_px, FontStyle::Normal)
            .transform(turn)
            .color(&plotters::style::BLACK);
        style.pos = Pos::new(h_pos, v_pos);
        // A name may hold anything; XML does not allow control characters.
        let printable: String =
            text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        let at = self.device(at);
        self.sheet.text(&printable, &style, at)
    }

    /// A picture of backend pixels, three bytes each, with its upper left corner at a point.
    pub fn image(&mut self, at: Point, size_px: (u32, u32), rgb: &[u8]) -> Result<(), CanvasError> {
        let at = self.device(at);
        self.sheet.image(at, size_px, rgb)
    }
}

/// A convex shape, its corners clockwise on the sheet, with every side moved outwards.
fn grown(corners: &[Point], by: f64) -> Vec<Point> {
    let count = corners.len();
    (0..count)
        .map(|index| {
            let (before, at) = (corners[(index + count - 1) % count], corners[index]);
            let after = corners[(index + 1) % count];
            let (in_x, in_y) = direction(before, at);
            let (out_x, out_y) = direction(at, after);
            // The outward normals of both sides; their sum points along the mitre.
            let (x, y) = (in_y + out_y, -in_x - out_x);
            let length = by / (1.0 + in_x * out_x + in_y * out_y);
            (at.0 + x * length, at.1 + y * length)
        })
        .collect()
}

/// Unit vector from one point to another.
fn direction(from: Point, to: Point) -> Point {
    let (x, y) = (to.0 - from.0, to.1 - from.1);
    let length = x.hypot(y);
    (x / length, y / length)
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

    #[test]
    fn a_square_grows_on_all_sides() {
        let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        assert_eq!(grown(&square, 1.0), [(-1.0, -1.0), (5.0, -1.0), (5.0, 5.0), (-1.0, 5.0)]);
    }
}
