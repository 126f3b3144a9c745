//! Cells of a map as pixels.

use crate::canvas::Rgb;

/// Cells of a map.
pub struct Cells<'a> {
    /// Borders of the columns, rising.
    pub column_borders: &'a [f64],
    /// Borders of the rows, rising.
    pub row_borders: &'a [f64],
    /// The values, row by row.
    pub values: &'a [f64],
}

impl Cells<'_> {
    /// The cells as an image of the given size, three bytes a pixel, the topmost row of pixels first. Cells
    /// without a value are hatched, so that they look like no reading at all.
    pub fn image(&self, (width, height): (u32, u32), colour: &dyn Fn(f64) -> Rgb) -> Vec<u8> {
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
    use super::*;

    fn pixel(image: &[u8], width: usize, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * width + x);
        (image[at], image[at + 1], image[at + 2])
    }

    /// A grey that grows with the value.
    fn grey(value: f64) -> Rgb {
        let level = (50.0 * value) as u8;
        (level, level, level)
    }

    #[test]
    fn the_first_row_is_at_the_bottom() {
        let cells = Cells {
            column_borders: &[0.0, 1.0, 2.0],
            row_borders: &[0.0, 1.0, 2.0],
            values: &[1.0, 2.0, 0.5, 4.0],
        };
        let image = cells.image((20, 20), &grey);
        assert_eq!(pixel(&image, 20, 15, 4), grey(4.0));
        assert_eq!(pixel(&image, 20, 4, 4), grey(0.5));
        assert_eq!(pixel(&image, 20, 4, 15), grey(1.0));
    }

    #[test]
    fn what_was_not_measured_is_hatched_not_zero() {
        let cells = Cells {
            column_borders: &[0.0, 1.0, 2.0],
            row_borders: &[0.0, 1.0],
            values: &[f64::NAN, 0.0],
        };
        let image = cells.image((200, 100), &grey);
        let left: Vec<Rgb> = (0..100).map(|x| pixel(&image, 200, x, 50)).collect();
        assert!(left.contains(&(255, 255, 255)) && left.contains(&(160, 160, 160)));
        assert!(!left.contains(&grey(0.0)));
        assert_eq!(pixel(&image, 200, 150, 50), grey(0.0));
    }

    #[test]
    fn uneven_cells_take_the_room_they_cover() {
        assert_eq!(cell_of_pixels(&[0.0, 1.0, 4.0], 4), [0, 1, 1, 1]);
    }
}
