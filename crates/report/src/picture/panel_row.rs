//! Panels of curves in a row: their layout, frames, titles and curves.

use super::axes::{Axes, LABEL_TEXT};
use super::marker::Series;
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Point};

const PANEL: (f64, f64) = (285.0, 250.0);
pub(super) const LEFT_ROOM: f64 = 84.0;
const TOP_ROOM: f64 = 34.0;
const BOTTOM_ROOM: f64 = 86.0;
const PANEL_GAP: f64 = 82.0;
const RIGHT_ROOM: f64 = 16.0;

/// Least width of a panel beside others, where a width is asked for, and of one that stands alone in its row.
const LEAST_WIDTH: (f64, f64) = (210.0, 150.0);
/// Distance of panels that stand one below the other: titles and axes.
const STACKED_GAP: f64 = 82.0;
/// Height of a line of the legend.
const LEGEND_LINE: f64 = 24.0;

/// Panels with a legend below.
#[derive(Debug, Clone)]
pub(super) struct PanelRow {
    panels: usize,
    panel_width: f64,
    /// Whether the panels stand one below the other.
    stacked: bool,
    /// Where each entry of the legend begins: from the left end of the panels, and its line. Without a width that was asked for, all
    /// are in one line.
    legend: Option<Vec<(f64, usize)>>,
}

impl PanelRow {
    /// Panels of the usual width.
    pub fn new(panels: usize) -> Self {
        Self { panels, panel_width: PANEL.0, stacked: false, legend: None }
    }

    /// Makes a picture as wide as asked for, CSS pixels, with a legend of entries of these widths; its panels stand one below the other
    /// where a row has no room.
    ///
    /// # Errors
    /// The least width.
    pub fn fit(&mut self, width: f64, legend: &[f64]) -> Result<(), f64> {
        let panels = self.panels as f64;
        let inside = width - LEFT_ROOM - RIGHT_ROOM;
        let in_row = (inside - (panels - 1.0) * PANEL_GAP) / panels;
        self.stacked = in_row < LEAST_WIDTH.0;
        self.panel_width = if self.stacked { inside } else { in_row };
        let longest = legend.iter().copied().fold(LEAST_WIDTH.1, f64::max);
        if inside < longest {
            return Err(LEFT_ROOM + longest + RIGHT_ROOM);
        }
        let (mut x, mut line) = (0.0, 0);
        let mut places = Vec::new();
        for entry in legend {
            if x > 0.0 && x + entry > inside {
                (x, line) = (0.0, line + 1);
            }
            places.push((x, line));
            x += entry;
        }
        self.legend = Some(places);
        Ok(())
    }

    fn rows(&self) -> usize {
        if self.stacked { self.panels } else { 1 }
    }

    fn panel_height(&self) -> f64 {
        PANEL.1.min(self.panel_width)
    }

    fn legend_lines(&self) -> usize {
        self.legend.iter().flatten().map(|(_, line)| line + 1).max().unwrap_or(1)
    }

    /// Width and height of the picture, CSS pixels.
    pub fn size(&self) -> (u32, u32) {
        let columns = (self.panels / self.rows()) as f64;
        let width =
            LEFT_ROOM + columns * self.panel_width + (columns - 1.0) * PANEL_GAP + RIGHT_ROOM;
        let (rows, lines) = (self.rows() as f64, (self.legend_lines() - 1) as f64);
        let panels = rows * self.panel_height() + (rows - 1.0) * STACKED_GAP;
        let height = TOP_ROOM + panels + BOTTOM_ROOM + lines * LEGEND_LINE;
        (width.ceil() as u32, height.ceil() as u32)
    }

    /// The frame of a panel, and the ranges that it shows.
    pub fn axes(&self, index: usize, x: (f64, f64), y: (f64, f64)) -> Axes {
        let (column, row) = if self.stacked { (0, index) } else { (index, 0) };
        let left = LEFT_ROOM + column as f64 * (self.panel_width + PANEL_GAP);
        let top = TOP_ROOM + row as f64 * (self.panel_height() + STACKED_GAP);
        Axes { corner: (left, top), width: self.panel_width, height: self.panel_height(), x, y }
    }

    /// Where an entry of the legend begins, of entries of these widths.
    pub fn legend_place(&self, index: usize, widths: &[f64]) -> Point {
        let (x, line) = match &self.legend {
            Some(places) => places[index],
            None => (widths[..index].iter().sum(), 0),
        };
        let below = (self.legend_lines() - 1 - line) as f64 * LEGEND_LINE;
        (LEFT_ROOM + x, f64::from(self.size().1) - 18.0 - below)
    }
}

/// Width and height of a picture of so many panels with a legend below, CSS pixels.
pub(super) fn size(panels: usize) -> (u32, u32) {
    PanelRow::new(panels).size()
}

/// The frame of a panel, and the ranges that it shows.
pub(super) fn axes(index: usize, x: (f64, f64), y: (f64, f64)) -> Axes {
    PanelRow::new(index + 1).axes(index, x, y)
}

/// The upper end of the axis of a panel whose largest value is `top`.
pub(super) fn a_little_above(top: f64) -> f64 {
    if top > 0.0 { 1.08 * top } else { 1.0 }
}

/// Draws the frame, the axis of values and the title.
pub(super) fn frame(
    canvas: &mut Canvas,
    axes: &Axes,
    title: &str,
    label: &str,
) -> Result<(), CanvasError> {
    axes.frame(canvas)?;
    axes.y_axis(canvas, label)?;
    let title_at = (axes.corner.0, axes.corner.1 - 6.0);
    canvas.text(title, title_at, LABEL_TEXT + 1.0, Align::AboveRight)
}

/// The line of a numbered series, as far as it stays in the panel.
pub(super) fn curve(
    canvas: &mut Canvas,
    axes: &Axes,
    number: usize,
    points: &[(f64, f64)],
) -> Result<(), CanvasError> {
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
