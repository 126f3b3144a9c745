//! Focal radius, peak and sub-peaks over the two parameters that a study sweeps.

use plotters::backend::DrawingBackend;

use super::axes::{Axes, LABEL_TEXT};
use super::canvas::{Align, Canvas};
use super::colour_scale::ColourScale;
use super::raster::{Cells, borders, colour_bar};
use super::study_curves::{axis_label, titles};
use super::{Picture, PictureError};
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

/// Three maps of a study over its first sweep (x) and its second (y).
pub(crate) struct StudySurfaces<'a> {
    study: &'a Study,
    result: &'a StudyResult,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl<'a> StudySurfaces<'a> {
    /// The maps of a study with two sweeps over rising numbers; `None` for others.
    pub fn new(study: &'a Study, result: &'a StudyResult) -> Option<Self> {
        let [first, second] = &study.sweeps[..] else { return None };
        let (x, y) = (first.ascending_numbers()?, second.ascending_numbers()?);
        Some(Self { study, result, x, y })
    }

    fn panel<B: DrawingBackend>(
        &self,
        canvas: &mut Canvas<B>,
        index: usize,
        figure: Figure,
    ) -> Result<(), PictureError> {
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
        let left = LEFT_ROOM + index as f64 * (PANEL.0 + PANEL_GAP);
        let axes = Axes {
            corner: (left, TOP_ROOM),
            width: PANEL.0,
            height: PANEL.1,
            x: ends(&columns),
            y: ends(&rows),
        };
        let colour = |value| scale.colour(value);
        let cells = Cells { column_borders: &columns, row_borders: &rows, values: &values };
        cells.draw(canvas, &axes, colour)?;
        axes.x_axis(canvas, &axis_label(&self.study.sweeps[0].parameters))?;
        axes.y_axis(canvas, &axis_label(&self.study.sweeps[1].parameters))?;
        let (title, label) = titles(figure);
        canvas.text(title, (left, TOP_ROOM - 6.0), LABEL_TEXT + 1.0, Align::AboveRight)?;

        let bar = Axes {
            corner: (left + PANEL.0 + BAR_GAP, TOP_ROOM),
            width: BAR_WIDTH,
            x: (0.0, 1.0),
            y: (0.0, scale.top),
            ..axes
        };
        colour_bar(canvas, &bar, label, colour)
    }
}

impl Picture for StudySurfaces<'_> {
    fn size(&self) -> (u32, u32) {
        let panels = Figure::ALL.len() as f64;
        let width = LEFT_ROOM + panels * PANEL.0 + (panels - 1.0) * PANEL_GAP + RIGHT_ROOM;
        (width.ceil() as u32, (TOP_ROOM + PANEL.1 + BOTTOM_ROOM).ceil() as u32)
    }

    fn description(&self) -> String {
        let [first, second] = [0, 1].map(|index| self.study.sweeps[index].name());
        format!(
            "Focal radius, peak and number of sub-peaks as colour maps over {first} and {second}; no value where the peak is \
             outside the map."
        )
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<B>) -> Result<(), PictureError> {
        Figure::ALL
            .into_iter()
            .enumerate()
            .try_for_each(|(index, figure)| self.panel(canvas, index, figure))
    }
}
