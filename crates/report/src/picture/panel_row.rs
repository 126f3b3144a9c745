//! Panels of curves in a row: their layout, frames, titles and curves.

use plotters::backend::DrawingBackend;

use super::PictureError;
use super::axes::{Axes, LABEL_TEXT};
use super::canvas::{Align, Canvas, Pen, Point};
use super::marker::Series;

const PANEL: (f64, f64) = (285.0, 250.0);
pub(super) const LEFT_ROOM: f64 = 84.0;
const TOP_ROOM: f64 = 34.0;
const BOTTOM_ROOM: f64 = 86.0;
const PANEL_GAP: f64 = 82.0;
const RIGHT_ROOM: f64 = 16.0;

/// Width and height of a picture of so many panels with a legend below, CSS pixels.
pub(super) fn size(panels: usize) -> (u32, u32) {
    let panels = panels as f64;
    let width = LEFT_ROOM + panels * PANEL.0 + (panels - 1.0) * PANEL_GAP + RIGHT_ROOM;
    (width.ceil() as u32, (TOP_ROOM + PANEL.1 + BOTTOM_ROOM).ceil() as u32)
}

/// The frame of a panel, and the ranges that it shows.
pub(super) fn axes(index: usize, x: (f64, f64), y: (f64, f64)) -> Axes {
    Axes {
        corner: (LEFT_ROOM + index as f64 * (PANEL.0 + PANEL_GAP), TOP_ROOM),
        width: PANEL.0,
        height: PANEL.1,
        x,
        y,
    }
}

/// The upper end of the axis of a panel whose largest value is `top`.
pub(super) fn a_little_above(top: f64) -> f64 {
    if top > 0.0 { 1.08 * top } else { 1.0 }
}

/// Draws the frame, the axis of values and the title.
pub(super) fn frame<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    axes: &Axes,
    title: &str,
    label: &str,
) -> Result<(), PictureError> {
    axes.frame(canvas)?;
    axes.y_axis(canvas, label)?;
    let title_at = (axes.corner.0, axes.corner.1 - 6.0);
    canvas.text(title, title_at, LABEL_TEXT + 1.0, Align::AboveRight)
}

/// The line of a numbered series, as far as it stays in the panel.
pub(super) fn curve<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    axes: &Axes,
    number: usize,
    points: &[(f64, f64)],
) -> Result<(), PictureError> {
    let series = Series::Numbered(number);
    let pen = Pen { colour: series.colour(), width: 2.0 };
    for inside in points.chunk_by(|a, b| axes.holds(a.0, a.1) == axes.holds(b.0, b.1)) {
        if axes.holds(inside[0].0, inside[0].1) {
            let line: Vec<Point> = inside.iter().map(|&(x, y)| axes.place(x, y)).collect();
            canvas.dashed(&line, series.dash(), pen)?;
        }
    }
    Ok(())
}
