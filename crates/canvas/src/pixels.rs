//! Drawings as pixels, and as the text of an SVG.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ColorType, ImageEncoder, RgbImage};
use plotters::backend::{BitMapBackend, SVGBackend};
use rayon::prelude::*;

use crate::CanvasError;
use crate::canvas::{Canvas, OVERSAMPLING};
use crate::sheet::Sheet;

/// A drawing of so many pixels, `scale` to a CSS pixel; each is the mean of a square of `side` that is drawn for it.
///
/// # Errors
/// [`CanvasError`], or what the drawing returns.
pub fn bitmap<E: From<CanvasError>>(
    (width, height): (u32, u32),
    scale: f64,
    side: u32,
    draw: impl FnOnce(&mut Canvas) -> Result<(), E>,
) -> Result<RgbImage, E> {
    let (large_width, large_height) = (width * side, height * side);
    let mut pixels = vec![255; 3 * large_width as usize * large_height as usize];
    {
        let size_px = (large_width, large_height);
        let mut sheet = Sheet::Bitmap(BitMapBackend::with_buffer(&mut pixels, size_px));
        draw(&mut Canvas::new(&mut sheet, scale * f64::from(side))?)?;
    }
    let small = averaged(&pixels, large_width as usize, side as usize);
    Ok(RgbImage::from_raw(width, height, small).expect("as many bytes as pixels times three"))
}

/// A drawing of a size in CSS pixels as an SVG's text, and the size in the units of its view box, [`OVERSAMPLING`] to a CSS pixel.
///
/// # Errors
/// [`CanvasError`], or what the drawing returns.
pub fn svg<E: From<CanvasError>>(
    (width, height): (u32, u32),
    draw: impl FnOnce(&mut Canvas) -> Result<(), E>,
) -> Result<(String, (u32, u32)), E> {
    let size_px = (width * OVERSAMPLING, height * OVERSAMPLING);
    let mut file = String::new();
    {
        let mut sheet = Sheet::Svg(SVGBackend::with_string(&mut file, size_px));
        draw(&mut Canvas::new(&mut sheet, f64::from(OVERSAMPLING))?)?;
        sheet.present()?;
    }
    Ok((file, size_px))
}

/// Pixels of three bytes as a PNG file.
///
/// # Errors
/// [`CanvasError::Encoding`].
pub fn png(rgb: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, CanvasError> {
    let mut file = Vec::new();
    // Cells of one colour compress best as they are.
    PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::NoFilter)
        .write_image(rgb, width, height, ColorType::Rgb8)?;
    Ok(file)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_become_their_means() {
        let side = 2;
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
