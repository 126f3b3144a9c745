//! A transducer's pressure on and off its axis, and the width of its lobe against height.

use super::axes::{Axes, LABEL_TEXT};
use super::marker::Series;
use super::plane_maps::reading_label;
use super::{Picture, panel_row};
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Point};
use fieldgap_characterization::{Characterization, LEVELS_DB, PairFit};

/// Points of a curve.
const STEPS: u32 = 120;

/// Three panels: on the axis, off the axis, width of the lobe.
pub(crate) struct TransducerCurves<'a> {
    found: &'a Characterization,
    unit: &'a str,
}

impl<'a> TransducerCurves<'a> {
    /// The curves of a transducer, its readings in a unit.
    pub fn new(found: &'a Characterization, unit: &'a str) -> Self {
        Self { found, unit }
    }

    fn on_axis(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let points = &self.found.profile.on_axis;
        if points.len() < 2 {
            return Ok(());
        }
        let heights = || points.iter().map(|point| point.height_m * 1e3);
        let (from, to) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let top = points.iter().map(|point| point.value).fold(0.0, f64::max);
        let axes = panel_row::axes(0, widened(from, to), (0.0, panel_row::a_little_above(top)));
        panel_row::frame(canvas, &axes, "on the axis", &reading_label(self.unit))?;
        axes.x_axis(canvas, "height z (mm)")?;
        dots(canvas, &axes, points.iter().map(|point| (point.height_m * 1e3, point.value)))?;
        for (number, (pair, _)) in self.found.axis_laws().into_iter().enumerate() {
            let height = |step: u32| from + (to - from) * f64::from(step) / f64::from(STEPS);
            let line = (0..=STEPS)
                .map(|step| (height(step), pair.on_axis_at(height(step) * 1e-3)))
                .collect::<Vec<_>>();
            panel_row::curve(canvas, &axes, number + 1, &line)?;
        }
        Ok(())
    }

    fn lobe(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let axes = panel_row::axes(1, (-2.0, 90.0), (-0.1, 1.15));
        panel_row::frame(canvas, &axes, "off the axis", "pressure relative to axis")?;
        axes.x_axis(canvas, "angle (°)")?;
        let bins = self.found.profile.lobe.iter();
        dots(canvas, &axes, bins.map(|bin| (bin.theta_rad.to_degrees(), bin.value)))?;
        for (number, (pair, _)) in self.found.lobe_laws().into_iter().enumerate() {
            panel_row::curve(canvas, &axes, number + 1, &lobe_of(pair))?;
        }
        Ok(())
    }

    fn angles(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let profile = &self.found.profile;
        let heights: Vec<f64> = profile.on_axis.iter().map(|point| point.height_m * 1e3).collect();
        let (Some(&first), Some(&last)) = (heights.first(), heights.last()) else { return Ok(()) };
        let axes = panel_row::axes(2, widened(first, last), (0.0, 90.0));
        panel_row::frame(canvas, &axes, "width of the lobe", "angle (°)")?;
        axes.x_axis(canvas, "height z (mm)")?;
        for (number, level) in LEVELS_DB.into_iter().enumerate() {
            let series = Series::Numbered(number);
            let own: Vec<(f64, f64)> = profile
                .angles
                .iter()
                .filter(|angle| angle.level_db == level)
                .map(|angle| (angle.height_m * 1e3, angle.angle_rad.to_degrees()))
                .collect();
            panel_row::curve(canvas, &axes, number, &own)?;
            for &(x, y) in &own {
                series.mark_on_curve(canvas, axes.place(x, y), true)?;
            }
            let Some(&(x, y)) = own.first() else { continue };
            let at = axes.place(x, y);
            let above = (at.0 - 6.0, at.1 - 8.0);
            canvas.text(&format!("{level} dB"), above, LABEL_TEXT, Align::AboveRight)?;
        }
        Ok(())
    }

    fn legend(
        &self,
        canvas: &mut Canvas,
        names: &[String],
        (mut x, y): Point,
    ) -> Result<(), CanvasError> {
        for (number, name) in names.iter().enumerate() {
            let series = Series::Numbered(number + 1);
            let pen = Pen { colour: series.colour(), width: 2.0 };
            canvas.dashed(&[(x, y), (x + 30.0, y)], series.dash(), pen)?;
            canvas.text(name, (x + 36.0, y), LABEL_TEXT, Align::Right)?;
            x += 54.0 + 7.2 * name.chars().count() as f64;
        }
        Ok(())
    }
}

impl Picture for TransducerCurves<'_> {
    fn size(&self) -> (u32, u32) {
        let (width, height) = panel_row::size(3);
        (width, height + 22)
    }

    fn description(&self) -> String {
        "Pressure on the axis against height, relative pressure against angle, and the angles at which the lobe has fallen \
         by 6, 14 and 20 dB against height; readings as dots, fitted laws as lines."
            .to_owned()
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        self.on_axis(canvas)?;
        self.lobe(canvas)?;
        self.angles(canvas)?;
        let bottom = f64::from(self.size().1);
        let axis_laws = self.found.axis_laws();
        let names: Vec<String> =
            axis_laws.iter().map(|(pair, _)| pair.axis_law.to_string()).collect();
        self.legend(canvas, &names, (panel_row::LEFT_ROOM, bottom - 40.0))?;
        let lobes = self.found.lobe_laws();
        let names: Vec<String> = lobes.iter().map(|(pair, _)| pair.lobe_law.to_string()).collect();
        let x = panel_row::axes(1, (0.0, 1.0), (0.0, 1.0)).corner.0;
        self.legend(canvas, &names, (x, bottom - 16.0))
    }
}

/// A fitted lobe, degrees and relative pressure.
pub(super) fn lobe_of(pair: &PairFit) -> Vec<(f64, f64)> {
    (0..=STEPS)
        .map(|step| 90.0 * f64::from(step) / f64::from(STEPS))
        .map(|degrees| (degrees, pair.lobe_at(degrees.to_radians())))
        .collect()
}

fn widened(from: f64, to: f64) -> (f64, f64) {
    let margin = 0.06 * (to - from);
    (from - margin, to + margin)
}

fn dots(
    canvas: &mut Canvas,
    axes: &Axes,
    points: impl Iterator<Item = (f64, f64)>,
) -> Result<(), CanvasError> {
    for (x, y) in points.filter(|&(x, y)| axes.holds(x, y)) {
        Series::Numbered(0).mark_on_curve(canvas, axes.place(x, y), true)?;
    }
    Ok(())
}
