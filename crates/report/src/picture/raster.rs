//! Maps of readings as cells.

use fieldgap_canvas::{Canvas, CanvasError, Cells, Rgb};

use super::axes::Axes;

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

/// Draws cells, which fill the axes, and their frame.
pub(super) fn cells(
    cells: &Cells<'_>,
    canvas: &mut Canvas,
    axes: &Axes,
    colour: impl Fn(f64) -> Rgb,
) -> Result<(), CanvasError> {
    let scale = canvas.scale();
    let pixels = |length: f64| ((length * scale).round() as u32).max(1);
    let size_px = (pixels(axes.width), pixels(axes.height));
    canvas.image(axes.corner, size_px, &cells.image(size_px, &colour))?;
    axes.frame(canvas)
}

/// A colour bar over the y range of its axes, with numbers and a label on its right.
pub(super) fn colour_bar(
    canvas: &mut Canvas,
    axes: &Axes,
    colour: impl Fn(f64) -> Rgb,
) -> Result<(), CanvasError> {
    let (from, to) = axes.y;
    let level = |step: f64| from + (to - from) * step / f64::from(BAR_STEPS);
    let levels: Vec<f64> = (0..=BAR_STEPS).map(|step| level(f64::from(step))).collect();
    let values: Vec<f64> = (0..BAR_STEPS).map(|step| level(f64::from(step) + 0.5)).collect();
    let of_bar = Cells { column_borders: &[0.0, 1.0], row_borders: &levels, values: &values };
    cells(&of_bar, canvas, axes, colour)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_lie_midway_and_as_far_outside() {
        assert_eq!(borders(&[0.0, 2.0, 6.0], 1.0), [-1.0, 1.0, 4.0, 8.0]);
        assert_eq!(borders(&[3.0], 1.0), [2.5, 3.5]);
        assert!(borders(&[], 1.0).is_empty());
    }
}
