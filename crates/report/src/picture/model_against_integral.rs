//! A transducer model compared with the integral over a vibrating face.

use super::axes::LABEL_TEXT;
use super::marker::Series;
use super::{Picture, panel_row};
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Point};
use fieldgap_study::{LOBE_DISTANCES_M, ModelAgainstIntegral};

/// Errors beyond this are off the panel, percent of the axis.
const WORST_PERCENT: f64 = 30.0;

/// Three panels: on the axis, the lobe, and its error at three distances.
pub(crate) struct ModelCurves<'a>(pub &'a ModelAgainstIntegral);

impl ModelCurves<'_> {
    fn on_axis(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let top = self.0.on_axis.iter().map(|(_, model, truth)| model.max(*truth));
        let top = top.fold(0.0, f64::max).min(2.0);
        let axes = panel_row::axes(0, (0.0, 305.0), (0.0, panel_row::a_little_above(top)));
        panel_row::frame(canvas, &axes, "on the axis", "pressure times height")?;
        axes.x_axis(canvas, "height z (mm)")?;
        let line = |read: fn(&(f64, f64, f64)) -> f64| -> Vec<(f64, f64)> {
            self.0.on_axis.iter().map(|row| (row.0 * 1e3, read(row))).collect()
        };
        panel_row::curve(canvas, &axes, 0, &line(|row| row.2))?;
        panel_row::curve(canvas, &axes, 1, &line(|row| row.1))
    }

    fn lobe(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = panel_row::axes(1, (0.0, 90.0), (0.0, 1.1));
        let title = format!("lobe at {:.0} mm", LOBE_DISTANCES_M[1] * 1e3);
        panel_row::frame(canvas, &axes, &title, "pressure relative to axis")?;
        axes.x_axis(canvas, "angle (°)")?;
        let line = |read: fn(&(f64, f64, f64)) -> f64| -> Vec<(f64, f64)> {
            self.0.lobes[1].iter().map(|row| (row.0.to_degrees(), read(row))).collect()
        };
        panel_row::curve(canvas, &axes, 0, &line(|row| row.2))?;
        panel_row::curve(canvas, &axes, 1, &line(|row| row.1))
    }

    fn errors(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let error = |row: &(f64, f64, f64)| 100.0 * (row.1 - row.2).abs();
        let worst = self.0.lobes.iter().flatten().map(error).fold(0.0, f64::max);
        let top = panel_row::a_little_above(worst).clamp(0.02, WORST_PERCENT);
        let axes = panel_row::axes(2, (0.0, 90.0), (0.0, top));
        panel_row::frame(canvas, &axes, "error of the lobe", "% of pressure on axis")?;
        axes.x_axis(canvas, "angle (°)")?;
        for (number, lobe) in self.0.lobes.iter().enumerate() {
            let line: Vec<(f64, f64)> =
                lobe.iter().map(|row| (row.0.to_degrees(), error(row))).collect();
            panel_row::curve(canvas, &axes, number + 1, &line)?;
        }
        Ok(())
    }
}

impl Picture for ModelCurves<'_> {
    fn size(&self) -> (u32, u32) {
        panel_row::size(3)
    }

    fn description(&self) -> String {
        format!(
            "The {} transducer compared with the integral over its face: on the axis, the lobe, and the error of the lobe at three \
             distances.",
            self.0.simulator
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        self.on_axis(canvas)?;
        self.lobe(canvas)?;
        self.errors(canvas)?;
        let y = f64::from(self.size().1) - 18.0;
        let entry = |canvas: &mut Canvas, at: Point, number: usize, words: &str| {
            let series = Series::Numbered(number);
            let pen = Pen { colour: series.colour(), width: 2.0 };
            canvas.dashed(&[at, (at.0 + 36.0, at.1)], series.dash(), pen)?;
            canvas.text(words, (at.0 + 42.0, at.1), LABEL_TEXT, Align::Right)
        };
        entry(canvas, (panel_row::LEFT_ROOM, y), 0, "integral over the face")?;
        let name = self.0.simulator.to_string();
        entry(canvas, (panel_row::LEFT_ROOM + 230.0, y), 1, &name)?;
        let left = panel_row::axes(2, (0.0, 1.0), (0.0, 1.0)).corner.0;
        for (number, distance_m) in LOBE_DISTANCES_M.into_iter().enumerate() {
            let words = format!("{:.0} mm", distance_m * 1e3);
            entry(canvas, (left - 48.0 + 112.0 * number as f64, y), number + 1, &words)?;
        }
        Ok(())
    }
}
