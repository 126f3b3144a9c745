//! A sheet to draw pictures on, in CSS pixels with fractions, the same for PNG and SVG; and maps as pixels.
//!
//! Begin with [`bitmap`] and [`svg`], which give a [`Canvas`] to a function that draws. [`Cells`] makes pixels of the values of a map.

mod canvas;
mod cells;
mod font;
mod pixels;
mod sheet;

pub use canvas::{Align, BLACK, Canvas, GREY, OVERSAMPLING, Pen, Point, Rgb, WHITE};
pub use cells::Cells;
pub use pixels::{bitmap, png, svg};

/// Why something could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum CanvasError {
    /// The drawing library reported an error.
    #[error("drawing a picture failed: {0}")]
    Drawing(String),
    /// The pixels could not be encoded.
    #[error("encoding a picture as PNG failed")]
    Encoding(#[from] image::ImageError),
}
