//! Focal radius, peak and sub-peaks over the two parameters that a study sweeps.

use plotters::backend::DrawingBackend;

use super::axes::{Axes, LABEL_TEXT};
use super::canvas::{Canvas, Lies, OVERSAMPLING};
use super::colour_scale::ColourScale;
use super::raster::{Cells, borders};
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
/// Colours of a bar.
const STEPS: u32 = 256;

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
        let (x, y) = (first.rising_numbers()?, second.rising_numbers()?);
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
        image(canvas, &axes, &columns, &rows, &values, scale)?;
        axes.x_axis(canvas, &axis_label(&self.study.sweeps[0].parameters))?;
        axes.y_axis(canvas, &axis_label(&self.study.sweeps[1].parameters))?;
        let (title, label) = titles(figure);
        canvas.text(title, (left, TOP_ROOM - 6.0), LABEL_TEXT + 1.0, Lies::AboveRight)?;

        let bar = Axes {
            corner: (left + PANEL.0 + BAR_GAP, TOP_ROOM),
            width: BAR_WIDTH,
            x: (0.0, 1.0),
            y: (0.0, scale.top),
            ..axes
        };
        let level = |step: f64| scale.top * step / f64::from(STEPS);
        let levels: Vec<f64> = (0..=STEPS).map(|step| level(f64::from(step))).collect();
        let middles: Vec<f64> = (0..STEPS).map(|step| level(f64::from(step) + 0.5)).collect();
        image(canvas, &bar, &[0.0, 1.0], &levels, &middles, scale)?;
        bar.right_axis(canvas, label)
    }
}

/// Cells filled with their colours, in a frame.
fn image<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    axes: &Axes,
    column_borders: &[f64],
    row_borders: &[f64],
    values: &[f64],
    scale: ColourScale,
) -> Result<(), PictureError> {
    let pixels = |length: f64| (length * f64::from(OVERSAMPLING)).round() as u32;
    let size_px = (pixels(axes.width), pixels(axes.height));
    let cells = Cells { column_borders, row_borders, values };
    canvas.image(axes.corner, size_px, &cells.image(size_px, |value| scale.colour(value)))?;
    axes.frame(canvas)
}

impl Picture for StudySurfaces<'_> {
    fn size(&self) -> (u32, u32) {
        let panels = Figure::ALL.len() as f64;
        let width = LEFT_ROOM + panels * PANEL.0 + (panels - 1.0) * PANEL_GAP + RIGHT_ROOM;
        (width.ceil() as u32, (TOP_ROOM + PANEL.1 + BOTTOM_ROOM).ceil() as u32)
    }

    fn description(&self) -> String {
        let [first, second] = [0, 1].map(|index| self.study.sweeps[index].name());
        format!("Focal radius, peak and number of sub-peaks as colours over {first} and {second}.")
    }

    fn draw<B: DrawingBackend>(&self, canvas: &mut Canvas<B>) -> Result<(), PictureError> {
        Figure::ALL
            .into_iter()
            .enumerate()
            .try_for_each(|(index, figure)| self.panel(canvas, index, figure))
    }
}
