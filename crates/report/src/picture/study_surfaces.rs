//! Focal radius, peak and sub-peaks over the two parameters that a study sweeps.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::colour_scale::ColourScale;
use super::raster::{self, borders, colour_bar};
use super::study_curves::{axis_label, titles};
use fieldgap_canvas::{Align, Canvas, CanvasError, Cells};
use fieldgap_study::{Figure, Study, StudyResult};

const PANEL: (f64, f64) = (270.0, 250.0);
const LEFT_ROOM: f64 = 84.0;
const TOP_ROOM: f64 = 34.0;
const BOTTOM_ROOM: f64 = 62.0;
const BAR_GAP: f64 = 14.0;
const BAR_WIDTH: f64 = 14.0;
/// From one panel to the next: its colour bar with numbers, and the next one's axis.
const PANEL_GAP: f64 = 186.0;
const RIGHT_ROOM: f64 = 110.0;
/// Least width of a map, where a width is asked for.
const LEAST_WIDTH: f64 = 120.0;
/// Distance of maps that stand one below the other: titles and axes.
const STACKED_GAP: f64 = 80.0;

/// Three maps of a study over its first sweep (x) and its second (y).
pub(crate) struct StudySurfaces<'a> {
    study: &'a Study,
    result: &'a StudyResult,
    x: Vec<f64>,
    y: Vec<f64>,
    panel_width: f64,
    /// Whether the maps stand one below the other.
    stacked: bool,
}

impl<'a> StudySurfaces<'a> {
    /// The maps of a study with two sweeps over rising numbers; `None` for others.
    pub fn new(study: &'a Study, result: &'a StudyResult) -> Option<Self> {
        let [first, second] = &study.sweeps[..] else { return None };
        let (x, y) = (first.ascending_numbers()?, second.ascending_numbers()?);
        Some(Self { study, result, x, y, panel_width: PANEL.0, stacked: false })
    }

    fn panel(&self, canvas: &mut Canvas, index: usize, figure: Figure) -> Result<(), CanvasError> {
        let mut values = vec![f64::NAN; self.x.len() * self.y.len()];
        for row in &self.result.rows {
            if let Some(found) = row.figure(figure) {
                values[row.values[1] * self.x.len() + row.values[0]] = found.median;
            }
        }
        let largest = values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
        let scale = ColourScale { top: if largest > 0.0 { largest } else { 1.0 } };
        let (columns, rows) = (borders(&self.x, 1.0), borders(&self.y, 1.0));
        let ends = |borders: &[f64]| (borders[0], borders[borders.len() - 1]);
        let (column, row) = if self.stacked { (0, index) } else { (index, 0) };
        let left = LEFT_ROOM + column as f64 * (self.panel_width + PANEL_GAP);
        let top = TOP_ROOM + row as f64 * (PANEL.1 + STACKED_GAP);
        let axes = Axes {
            corner: (left, top),
            width: self.panel_width,
            height: PANEL.1,
            x: ends(&columns),
            y: ends(&rows),
        };
        let colour = |value| scale.colour(value);
        let cells = Cells { column_borders: &columns, row_borders: &rows, values: &values };
        raster::cells(&cells, canvas, &axes, colour)?;
        axes.x_axis(canvas, &axis_label(&self.study.sweeps[0].parameters))?;
        axes.y_axis(canvas, &axis_label(&self.study.sweeps[1].parameters))?;
        let (title, label) = titles(figure);
        canvas.text(title, (left, top - 6.0), LABEL_TEXT + 1.0, Align::AboveRight)?;

        let bar = Axes {
            corner: (left + self.panel_width + BAR_GAP, top),
            width: BAR_WIDTH,
            x: (0.0, 1.0),
            y: (0.0, scale.top),
            ..axes
        };
        colour_bar(canvas, &bar, colour)?;
        bar.right_axis(canvas, label)
    }
}

impl Picture for StudySurfaces<'_> {
    fn size(&self) -> (u32, u32) {
        let panels = Figure::ALL.len() as f64;
        let (columns, rows) = if self.stacked { (1.0, panels) } else { (panels, 1.0) };
        let width =
            LEFT_ROOM + columns * self.panel_width + (columns - 1.0) * PANEL_GAP + RIGHT_ROOM;
        let height = TOP_ROOM + rows * PANEL.1 + (rows - 1.0) * STACKED_GAP + BOTTOM_ROOM;
        (width.ceil() as u32, height.ceil() as u32)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let panels = Figure::ALL.len() as f64;
        let inside = width - LEFT_ROOM - RIGHT_ROOM;
        let in_row = (inside - (panels - 1.0) * PANEL_GAP) / panels;
        self.stacked = in_row < LEAST_WIDTH;
        self.panel_width = if self.stacked { inside } else { in_row };
        if inside < LEAST_WIDTH { Err(LEFT_ROOM + LEAST_WIDTH + RIGHT_ROOM) } else { Ok(()) }
    }

    fn description(&self) -> String {
        let [first, second] = [0, 1].map(|index| self.study.sweeps[index].name());
        format!(
            "Focal radius, peak and number of sub-peaks as colour maps over {first} and {second}; no value where the peak is \
             outside the map."
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        Figure::ALL
            .into_iter()
            .enumerate()
            .try_for_each(|(index, figure)| self.panel(canvas, index, figure))
    }
}
