//! Pictures as PNG and SVG, and moving pictures.

mod animation;
mod axes;
mod bar_chart;
mod canvas;
mod colour_scale;
mod display_map;
mod diverging_scale;
mod font;
mod height_curves;
mod map_layout;
mod marker;
mod model_against_integral;
mod panel_row;
mod plane_maps;
mod polar_lobe;
mod raster;
mod residual_maps;
mod residual_planes;
mod study_curves;
mod study_field;
mod study_surfaces;
mod transducer_curves;

use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::prelude::DrawingBackend;
use rayon::prelude::*;

pub(super) use self::animation::animated;
pub(super) use self::bar_chart::{Bar, BarChart, Weight};
pub(super) use self::display_map::{DisplayMap, DisplayPanel};
pub(super) use self::height_curves::HeightCurves;
pub(super) use self::model_against_integral::ModelCurves;
pub(super) use self::plane_maps::{LEAST_SIGNED_SHARE, PlaneMaps};
pub(super) use self::polar_lobe::PolarLobe;
pub(super) use self::residual_maps::{LEAST_SIGNED_SIGMA, REACH_SIGMA, ResidualMaps, rms};
pub(super) use self::residual_planes::ResidualPlanes;
pub(super) use self::study_curves::StudyCurves;
pub(super) use self::study_field::StudyField;
pub(super) use self::study_surfaces::StudySurfaces;
pub(super) use self::transducer_curves::TransducerCurves;

use self::canvas::{Canvas, OVERSAMPLING, TextFit};

/// PNG pixels in a CSS pixel: sharp on a screen of double density and on paper.
const PNG_DENSITY: u32 = 2;

/// Why a picture could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The drawing library reported an error.
    #[error("drawing a picture failed: {0}")]
    Drawing(String),
    /// The pixels could not be encoded.
    #[error("encoding a picture as PNG failed")]
    Encoding(#[from] image::ImageError),
    /// The pictures of an animation could not be encoded.
    #[error("encoding an animated picture as PNG failed")]
    Animating(#[from] png::EncodingError),
}

/// Something to draw.
pub(super) trait Picture {
    /// Width and height, CSS pixels.
    fn size(&self) -> (u32, u32);

    /// A description for readers who cannot see it.
    fn description(&self) -> String;

    /// Draws it.
    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<B>) -> Result<(), PictureError>;
}

/// A drawn picture.
pub(super) struct Drawn {
    /// Width and height, CSS pixels.
    pub size: (u32, u32),
    /// What it shows.
    pub description: String,
    /// The PNG file, twice as wide and high as `size`.
    pub png: Vec<u8>,
    /// The SVG file.
    pub svg: String,
}

impl Drawn {
    /// Draws a picture in both formats.
    pub fn new(picture: &impl Picture) -> Result<Self, PictureError> {
        Ok(Self {
            size: picture.size(),
            description: picture.description(),
            png: png(picture)?,
            svg: svg(picture)?,
        })
    }
}

fn png(picture: &impl Picture) -> Result<Vec<u8>, PictureError> {
    let small = pixels(picture, PNG_DENSITY)?;
    let mut file = Vec::new();
    // Cells of one colour compress best as they are.
    PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::NoFilter)
        .write_image(small.as_raw(), small.width(), small.height(), image::ColorType::Rgb8)?;
    Ok(file)
}

/// A picture in so many pixels to a CSS pixel, drawn large and made smaller, so that its edges are smooth.
fn pixels(picture: &impl Picture, density: u32) -> Result<image::RgbImage, PictureError> {
    let (width, height) = picture.size();
    let (large_width, large_height) = (width * OVERSAMPLING, height * OVERSAMPLING);
    let mut pixels = vec![255; 3 * large_width as usize * large_height as usize];
    {
        let mut backend = BitMapBackend::with_buffer(&mut pixels, (large_width, large_height));
        picture.draw(&mut Canvas::new(&mut backend, TextFit::BITMAP)?)?;
    }
    let small = averaged(&pixels, large_width as usize, (OVERSAMPLING / density) as usize);
    Ok(image::RgbImage::from_raw(width * density, height * density, small)
        .expect("as many bytes as pixels times three"))
}

/// Each pixel as the mean of the square of `side` that was drawn for it; colours of three bytes, rows of `width` pixels.
fn averaged(pixels: &[u8], width: usize, side: usize) -> Vec<u8> {
    let area = (side * side) as u32;
    pixels
        .par_chunks(3 * width * side)
        .flat_map_iter(|rows| {
            let mut sums = vec![0u32; 3 * width / side];
            for row in rows.chunks(3 * width) {
                for (square, sums) in row.chunks(3 * side).zip(sums.chunks_mut(3)) {
                    for pixel in square.chunks(3) {
                        for (sum, &channel) in sums.iter_mut().zip(pixel) {
                            *sum += u32::from(channel);
                        }
                    }
                }
            }
            sums.into_iter().map(move |sum| ((sum + area / 2) / area) as u8)
        })
        .collect()
}

fn svg(picture: &impl Picture) -> Result<String, PictureError> {
    let (width, height) = picture.size();
    let (large_width, large_height) = (width * OVERSAMPLING, height * OVERSAMPLING);
    let mut file = String::new();
    {
        let mut backend = SVGBackend::with_string(&mut file, (large_width, large_height));
        picture.draw(&mut Canvas::new(&mut backend, TextFit::SVG)?)?;
        backend.present().map_err(|error| PictureError::Drawing(error.to_string()))?;
    }
    // The `viewBox` keeps the fine coordinates; the size goes back to CSS pixels.
    let large = format!("width=\"{large_width}\" height=\"{large_height}\"");
    let true_size = format!("width=\"{width}\" height=\"{height}\"");
    Ok(file.replacen(&large, &true_size, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_become_their_means() {
        let side = (OVERSAMPLING / PNG_DENSITY) as usize;
        // Two squares beside each other: red with one black pixel, and green.
        let mut pixels = Vec::new();
        for row in 0..side {
            for column in 0..2 * side {
                let black = row == 0 && column == 0;
                pixels.extend(match (black, column < side) {
                    (true, _) => [0, 0, 0],
                    (_, true) => [200, 0, 0],
                    (_, false) => [0, 100, 0],
                });
            }
        }
        let area = (side * side) as f64;
        let red = (200.0 * (area - 1.0) / area).round() as u8;
        assert_eq!(averaged(&pixels, 2 * side, side), [red, 0, 0, 0, 100, 0]);
    }
}
