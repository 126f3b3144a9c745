//! A map of readings as pixels.

use plotters::backend::DrawingBackend;

use super::PictureError;
use super::axes::Axes;
use super::canvas::{Canvas, Rgb};

/// Colours of a bar.
const BAR_STEPS: u32 = 256;

/// Borders of the cells about rising positions: midway between neighbours, as far beyond the first and the
/// last as the nearest border is on their other side. A lone position gets a cell of the width `lone`.
pub(super) fn borders(along: &[f64], lone: f64) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (along.first(), along.last()) else { return Vec::new() };
    if along.len() == 1 {
        return vec![first - lone / 2.0, first + lone / 2.0];
    }
    let mut borders: Vec<f64> = along.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0).collect();
    borders.insert(0, 2.0 * first - borders[0]);
    borders.push(2.0 * last - borders[borders.len() - 1]);
    borders
}

/// Cells of a map: borders of the columns and rows, rising, and the values row by row.
pub(super) struct Cells<'a> {
    pub column_borders: &'a [f64],
    pub row_borders: &'a [f64],
    pub values: &'a [f64],
}

impl Cells<'_> {
    /// Draws the cells and their frame.
    pub fn draw<B: DrawingBackend>(
        &self,
        canvas: &mut Canvas<B>,
        axes: &Axes,
        colour: impl Fn(f64) -> Rgb,
    ) -> Result<(), PictureError> {
        let scale = canvas.scale();
        let pixels = |length: f64| ((length * scale).round() as u32).max(1);
        let size_px = (pixels(axes.width), pixels(axes.height));
        canvas.image(axes.corner, size_px, &self.image(size_px, colour))?;
        axes.frame(canvas)
    }

    /// The cells as an image of the given size, three bytes a pixel, the topmost row of pixels first. Cells
    /// without a value are hatched, so that they look like no reading at all.
    pub fn image(&self, (width, height): (u32, u32), colour: impl Fn(f64) -> Rgb) -> Vec<u8> {
        let columns = cell_of_pixels(self.column_borders, width);
        let mut rows = cell_of_pixels(self.row_borders, height);
        rows.reverse();
        let count = self.column_borders.len().saturating_sub(1);
        let colours: Vec<Option<Rgb>> =
            self.values.iter().map(|&value| value.is_finite().then(|| colour(value))).collect();
        let mut image = vec![0; 3 * columns.len() * rows.len()];
        for (y, (pixels, row)) in image.chunks_exact_mut(3 * columns.len()).zip(rows).enumerate() {
            for (x, (pixel, column)) in pixels.chunks_exact_mut(3).zip(&columns).enumerate() {
                let (red, green, blue) =
                    colours[row * count + column].unwrap_or_else(|| hatching(x, y));
                pixel.copy_from_slice(&[red, green, blue]);
            }
        }
        image
    }
}

/// A colour bar over the y range of its axes, with numbers and a label on its right.
pub(super) fn colour_bar<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    axes: &Axes,
    colour: impl Fn(f64) -> Rgb,
) -> Result<(), PictureError> {
    let (from, to) = axes.y;
    let level = |step: f64| from + (to - from) * step / f64::from(BAR_STEPS);
    let levels: Vec<f64> = (0..=BAR_STEPS).map(|step| level(f64::from(step))).collect();
    let values: Vec<f64> = (0..BAR_STEPS).map(|step| level(f64::from(step) + 0.5)).collect();
    let cells = Cells { column_borders: &[0.0, 1.0], row_borders: &levels, values: &values };
    cells.draw(canvas, axes, colour)
}

/// The cell at the centre of each of `pixels` pixels that share the whole range.
fn cell_of_pixels(borders: &[f64], pixels: u32) -> Vec<usize> {
    let (from, to) = (borders[0], borders[borders.len() - 1]);
    (0..pixels)
        .map(|pixel| {
            let at = from + (to - from) * (f64::from(pixel) + 0.5) / f64::from(pixels);
            let beyond = borders.partition_point(|&border| border <= at);
            beyond.clamp(1, borders.len() - 1) - 1
        })
        .collect()
}

/// Thin grey lines on white.
fn hatching(x: usize, y: usize) -> Rgb {
    if (x + y) % 28 < 4 { (160, 160, 160) } else { (255, 255, 255) }
}

#[cfg(test)]
mod tests {
    use super::super::colour_scale::ColourScale;
    use super::*;

    fn pixel(image: &[u8], width: usize, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * width + x);
        (image[at], image[at + 1], image[at + 2])
    }

    #[test]
    fn borders_lie_midway_and_as_far_outside() {
        assert_eq!(borders(&[0.0, 2.0, 6.0], 1.0), [-1.0, 1.0, 4.0, 8.0]);
        assert_eq!(borders(&[3.0], 1.0), [2.5, 3.5]);
        assert!(borders(&[], 1.0).is_empty());
    }

    #[test]
    fn the_largest_value_is_the_lightest_and_y_points_up() {
        let cells = Cells {
            column_borders: &[0.0, 1.0, 2.0],
            row_borders: &[0.0, 1.0, 2.0],
            values: &[1.0, 2.0, 0.5, 4.0],
        };
        let scale = ColourScale { top: 4.0 };
        let image = cells.image((20, 20), |value| scale.colour(value));
        assert_eq!(pixel(&image, 20, 15, 4), scale.colour(4.0));
        assert_eq!(pixel(&image, 20, 4, 4), scale.colour(0.5));
        assert_eq!(pixel(&image, 20, 4, 15), scale.colour(1.0));
    }

    #[test]
    fn what_was_not_measured_is_hatched_not_zero() {
        let cells = Cells {
            column_borders: &[0.0, 1.0, 2.0],
            row_borders: &[0.0, 1.0],
            values: &[f64::NAN, 0.0],
        };
        let scale = ColourScale { top: 1.0 };
        let image = cells.image((200, 100), |value| scale.colour(value));
        let left: Vec<Rgb> = (0..100).map(|x| pixel(&image, 200, x, 50)).collect();
        assert!(left.contains(&(255, 255, 255)) && left.contains(&(160, 160, 160)));
        assert!(!left.contains(&scale.colour(0.0)));
        assert_eq!(pixel(&image, 200, 150, 50), scale.colour(0.0));
    }

    #[test]
    fn uneven_cells_take_the_room_they_cover() {
        assert_eq!(cell_of_pixels(&[0.0, 1.0, 4.0], 4), [0, 1, 1, 1]);
    }
}
