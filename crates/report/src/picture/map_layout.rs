//! Maps side by side: their layout, cells, signs and colour bars.

use super::axes::{Axes, LABEL_TEXT};
use super::raster::{self, borders, colour_bar};
use fieldgap_canvas::{Align, Canvas, CanvasError, Cells, Pen, Rgb};

/// Room for a map, CSS pixels: maps are as large as fits, with equal millimetres along both axes.
const MAP_ROOM: (f64, f64) = (310.0, 360.0);
/// A panel is at least this wide, so that its title and legend have room.
const LEAST_PANEL_WIDTH: f64 = 190.0;
const LEFT_ROOM: f64 = 70.0;
const TOP_ROOM: f64 = 34.0;
const BOTTOM_ROOM: f64 = 82.0;
const PANEL_GAP: f64 = 22.0;
const BAR_WIDTH: f64 = 16.0;
/// Right of the last panel: a colour bar with its numbers and label.
const RIGHT_ROOM: f64 = 94.0;
/// Distance between signs, CSS pixels, at least.
const SIGN_SPACING: f64 = 15.0;

/// The same of a panel that stands alone in its row, whose title and legend reach beyond it.
const LEAST_STACKED_WIDTH: f64 = 110.0;
/// Most height of a map over the width of its panel, where a width is asked for.
const MOST_HEIGHT: f64 = 1.25;

/// Distance between panels that stand one below the other: titles and axes.
const STACKED_GAP: f64 = 66.0;
/// Height of a line of the legend.
const LEGEND_LINE: f64 = 24.0;

/// The layout of several maps of one grid.
#[derive(Clone)]
pub(super) struct MapLayout {
    x_mm: Vec<f64>,
    y_mm: Vec<f64>,
    column_borders_mm: Vec<f64>,
    row_borders_mm: Vec<f64>,
    map_width: f64,
    map_height: f64,
    panel_width: f64,
    /// Room for the bar of a panel before the last, beyond the gap that all have.
    bar_room: f64,
    /// The panel after which that is.
    bar_after: usize,
    /// Whether the panels stand one below the other.
    stacked: bool,
    /// Labels of the axes, across and up.
    labels: [&'static str; 2],
}

impl MapLayout {
    /// Panels for maps over rising columns and rows, metres; `None` where there are none.
    pub fn new(x_m: &[f64], y_m: &[f64]) -> Option<Self> {
        let millimetres = |along_m: &[f64]| along_m.iter().map(|m| m * 1e3).collect::<Vec<_>>();
        let (x_mm, y_mm) = (millimetres(x_m), millimetres(y_m));
        // A map of one column or row takes the step of its other axis for its width.
        let step = |along: &[f64]| along.windows(2).map(|pair| pair[1] - pair[0]).reduce(f64::min);
        let lone = step(&x_mm).or_else(|| step(&y_mm)).unwrap_or(1.0);
        let (columns, rows) = (borders(&x_mm, lone), borders(&y_mm, lone));
        let wide_mm = columns.last()? - columns.first()?;
        let high_mm = rows.last()? - rows.first()?;
        let per_mm = (MAP_ROOM.0 / wide_mm).min(MAP_ROOM.1 / high_mm);
        let map_width = (wide_mm * per_mm).max(4.0);
        Some(Self {
            x_mm,
            y_mm,
            column_borders_mm: columns,
            row_borders_mm: rows,
            map_width,
            map_height: (high_mm * per_mm).max(4.0),
            panel_width: map_width.max(LEAST_PANEL_WIDTH),
            bar_room: 0.0,
            bar_after: 0,
            stacked: false,
            labels: ["x (mm)", "y (mm)"],
        })
    }

    /// The same with room for a separate colour bar of the first panel.
    pub fn with_bar_after_first(mut self) -> Self {
        self.bar_room = RIGHT_ROOM;
        self
    }

    /// The same with room for a colour bar that the first two panels share.
    pub fn with_bar_after_second(mut self) -> Self {
        (self.bar_room, self.bar_after) = (RIGHT_ROOM, 1);
        self
    }

    /// The same with other labels of its axes, across and up.
    pub fn with_labels(mut self, labels: [&'static str; 2]) -> Self {
        self.labels = labels;
        self
    }

    /// The same with its panels one below the other.
    pub fn stacked(mut self) -> Self {
        self.stacked = true;
        self
    }

    /// Makes a picture of some panels as wide as asked for, CSS pixels; its panels stand one below the other where a row has no room.
    ///
    /// # Errors
    /// The least width.
    pub fn fit(&mut self, panels: usize, width: f64) -> Result<(), f64> {
        let right = PANEL_GAP + RIGHT_ROOM;
        let between =
            (panels - 1) as f64 * PANEL_GAP + self.bar_room.min((panels - 1) as f64 * RIGHT_ROOM);
        let in_row = (width - LEFT_ROOM - between - right) / panels as f64;
        self.stacked = in_row < LEAST_PANEL_WIDTH;
        let panel_width = if self.stacked { width - LEFT_ROOM - right } else { in_row };
        if panel_width < LEAST_STACKED_WIDTH {
            return Err(LEFT_ROOM + LEAST_STACKED_WIDTH + right);
        }
        let shape = self.map_height / self.map_width;
        self.map_width = panel_width.min(MOST_HEIGHT * panel_width / shape).max(4.0);
        self.map_height = (shape * self.map_width).max(4.0);
        self.panel_width = panel_width;
        Ok(())
    }

    /// Height on the sheet of the legend of a panel: below all panels, one line for each if they are stacked.
    pub fn legend_height(&self, panels: usize, panel: usize) -> f64 {
        let lines_below = if self.stacked { panels - 1 - panel } else { 0 };
        f64::from(self.size(panels).1) - 18.0 - lines_below as f64 * LEGEND_LINE
    }

    /// Width of a panel, CSS pixels; its map may be narrower.
    pub fn panel_width(&self) -> f64 {
        self.panel_width
    }

    /// Width and height of a picture of some panels with a colour bar after the last, CSS pixels.
    pub fn size(&self, panels: usize) -> (u32, u32) {
        let last = self.panel(panels - 1);
        let width = last.corner.0 + self.panel_width + PANEL_GAP + RIGHT_ROOM;
        let lines = if self.stacked { (panels - 1) as f64 * LEGEND_LINE } else { 0.0 };
        (width.ceil() as u32, (last.corner.1 + last.height + BOTTOM_ROOM + lines).ceil() as u32)
    }

    /// The frame of a panel, its axes in millimetres.
    pub fn panel(&self, index: usize) -> Axes {
        let ends = |borders: &[f64]| (borders[0], borders[borders.len() - 1]);
        let beyond_bar = if index > self.bar_after { self.bar_room } else { 0.0 };
        let corner = match self.stacked {
            true => (LEFT_ROOM, TOP_ROOM + index as f64 * (self.map_height + STACKED_GAP)),
            false => {
                let step = self.panel_width + PANEL_GAP;
                (LEFT_ROOM + index as f64 * step + beyond_bar, TOP_ROOM)
            }
        };
        Axes {
            corner,
            width: self.map_width,
            height: self.map_height,
            x: ends(&self.column_borders_mm),
            y: ends(&self.row_borders_mm),
        }
    }

    /// Draws a map, its frame, axes and title.
    pub fn map(
        &self,
        canvas: &mut Canvas,
        index: usize,
        title: &str,
        values: &[f64],
        colour: impl Fn(f64) -> Rgb,
    ) -> Result<Axes, CanvasError> {
        let axes = self.panel(index);
        let cells = Cells {
            column_borders: &self.column_borders_mm,
            row_borders: &self.row_borders_mm,
            values,
        };
        raster::cells(&cells, canvas, &axes, colour)?;
        axes.x_axis(canvas, self.labels[0])?;
        if index == 0 || self.stacked {
            axes.y_axis(canvas, self.labels[1])?;
        }
        let title_at = (axes.corner.0, axes.corner.1 - 6.0);
        canvas.text(title, title_at, LABEL_TEXT + 1.0, Align::AboveRight)?;
        Ok(axes)
    }

    /// A plus for values above zero and a minus for values below, from the magnitude `least` on. `contrast` gives the colour
    /// of the sign from the value.
    pub fn signs(
        &self,
        canvas: &mut Canvas,
        axes: &Axes,
        values: &[f64],
        least: f64,
        contrast: impl Fn(f64) -> Rgb,
    ) -> Result<(), CanvasError> {
        let columns = self.x_mm.len();
        let column_stride = stride(axes.width / columns as f64);
        let row_stride = stride(axes.height / self.y_mm.len() as f64);
        for row in (row_stride / 2..self.y_mm.len()).step_by(row_stride) {
            for column in (column_stride / 2..columns).step_by(column_stride) {
                let value = values[row * columns + column];
                if !value.is_finite() || value.abs() < least {
                    continue;
                }
                let (x, y) = axes.place(self.x_mm[column], self.y_mm[row]);
                let pen = Pen { colour: contrast(value), width: 1.25 };
                canvas.line((x - 3.5, y), (x + 3.5, y), pen)?;
                if value > 0.0 {
                    canvas.line((x, y - 3.5), (x, y + 3.5), pen)?;
                }
            }
        }
        Ok(())
    }

    /// The colour bar right of a panel.
    pub fn colour_bar(
        &self,
        canvas: &mut Canvas,
        after: usize,
        range: (f64, f64),
        label: &str,
        colour: impl Fn(f64) -> Rgb,
    ) -> Result<(), CanvasError> {
        let axes = self.bar_axes(after, range);
        colour_bar(canvas, &axes, colour)?;
        axes.right_axis(canvas, label)
    }

    /// The same of a scale from -1 to 1 that is not linear: the places with a number, and the numbers.
    pub fn marked_bar(
        &self,
        canvas: &mut Canvas,
        after: usize,
        marks: &[(f64, String)],
        label: &str,
        colour: impl Fn(f64) -> Rgb,
    ) -> Result<(), CanvasError> {
        let axes = self.bar_axes(after, (-1.0, 1.0));
        colour_bar(canvas, &axes, colour)?;
        axes.marked_right_axis(canvas, marks, label)
    }

    fn bar_axes(&self, after: usize, range: (f64, f64)) -> Axes {
        let panel = self.panel(after);
        // A bar between two panels stands close to its own.
        let gap = if after == self.bar_after && self.bar_room > 0.0 {
            PANEL_GAP / 2.0
        } else {
            PANEL_GAP
        };
        Axes {
            corner: (panel.corner.0 + self.panel_width + gap, panel.corner.1),
            width: BAR_WIDTH,
            height: panel.height,
            x: (0.0, 1.0),
            y: range,
        }
    }
}

/// The distance of signs in cells, for cells of the given size.
fn stride(cell: f64) -> usize {
    ((SIGN_SPACING / cell).ceil() as usize).max(1)
}
