//! What a picture is drawn on: pixels, or the text of an SVG.
//!
//! The drawing library's backends are types. Behind this one the pictures are compiled once for both.

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::style::{ShapeStyle, TextStyle};

use super::CanvasError;

/// A sheet, whose points are whole pixels.
pub(super) enum Sheet<'a> {
    /// Pixels of three bytes.
    Bitmap(BitMapBackend<'a>),
    /// An SVG's text.
    Svg(SVGBackend<'a>),
}

/// The same call of either backend.
macro_rules! on_either {
    ($sheet:expr, $backend:ident => $drawn:expr) => {
        match $sheet {
            Sheet::Bitmap($backend) => $drawn.map_err(drawing),
            Sheet::Svg($backend) => $drawn.map_err(drawing),
        }
    };
}

impl Sheet<'_> {
    /// Fills the whole sheet.
    pub fn fill_all(&mut self, style: &ShapeStyle) -> Result<(), CanvasError> {
        on_either!(self, backend => {
            let (width, height) = backend.get_size();
            backend.draw_rect((0, 0), (width as i32, height as i32), style, true)
        })
    }

    /// A straight line.
    pub fn line(
        &mut self,
        from: (i32, i32),
        to: (i32, i32),
        style: &ShapeStyle,
    ) -> Result<(), CanvasError> {
        on_either!(self, backend => backend.draw_path([from, to], style))
    }

    /// A filled polygon.
    pub fn polygon(
        &mut self,
        corners: Vec<(i32, i32)>,
        style: &ShapeStyle,
    ) -> Result<(), CanvasError> {
        on_either!(self, backend => backend.fill_polygon(corners, style))
    }

    /// A text at a point.
    pub fn text(
        &mut self,
        text: &str,
        style: &TextStyle<'_>,
        at: (i32, i32),
    ) -> Result<(), CanvasError> {
        on_either!(self, backend => backend.draw_text(text, style, at))
    }

    /// A picture of pixels of three bytes, with its upper left corner at a point.
    pub fn image(
        &mut self,
        at: (i32, i32),
        size_px: (u32, u32),
        rgb: &[u8],
    ) -> Result<(), CanvasError> {
        on_either!(self, backend => backend.blit_bitmap(at, size_px, rgb))
    }

    /// Writes out what is not written yet.
    pub fn present(&mut self) -> Result<(), CanvasError> {
        on_either!(self, backend => backend.present())
    }
}

fn drawing(error: impl std::error::Error) -> CanvasError {
    CanvasError::Drawing(error.to_string())
}
