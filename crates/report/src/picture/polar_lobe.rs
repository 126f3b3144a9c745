//! A transducer's lobe in decibels, as a polar plot.

use super::Picture;
use super::axes::{LABEL_TEXT, TICK_TEXT};
use super::marker::Series;
use super::transducer_curves::lobe_of;
use fieldgap_canvas::{Align, Canvas, CanvasError, GREY, Pen, Point};
use fieldgap_characterization::Characterization;

/// Centre of the half disc and its radius, CSS pixels.
const CENTRE: Point = (330.0, 330.0);
const RADIUS: f64 = 270.0;
const SIZE: (u32, u32) = (660, 430);
/// The level at the centre, decibels relative to the axis.
const FLOOR_DB: f64 = -40.0;
/// The level up to which there is room outside the outer ring.
const HIGHEST_DB: f64 = 3.0;

/// The readings about the axis and the fitted lobes.
pub(crate) struct PolarLobe<'a> {
    found: &'a Characterization,
}

impl<'a> PolarLobe<'a> {
    /// The lobe of a transducer.
    pub fn new(found: &'a Characterization) -> Self {
        Self { found }
    }

    fn grid(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let pen = Pen { colour: GREY, width: 1.0 };
        for step in 0..4 {
            let level_db = 0.0 - 10.0 * f64::from(step);
            let ring: Vec<Point> =
                (-90..=90).step_by(3).map(|angle| place(f64::from(angle), level_db)).collect();
            canvas.dashed(&ring, &[], pen)?;
            let (x, y) = place(-90.0, level_db);
            canvas.text(&format!("{level_db} dB"), (x, y + 4.0), TICK_TEXT, Align::Below)?;
        }
        for angle in (-90_i32..=90).step_by(30) {
            let degrees = f64::from(angle);
            canvas.line(place(degrees, FLOOR_DB), place(degrees, 0.0), pen)?;
            let (x, y) = place(degrees, 3.0);
            let align = match angle {
                ..0 => Align::Left,
                0 => Align::AboveRight,
                _ => Align::Right,
            };
            canvas.text(&format!("{}°", angle.abs()), (x, y), TICK_TEXT, align)?;
        }
        Ok(())
    }
}

/// The point of an angle and a level. Levels below the floor are at the centre.
fn place(degrees: f64, level_db: f64) -> Point {
    let reach = RADIUS * (1.0 - level_db / FLOOR_DB).max(0.0);
    let angle = degrees.to_radians();
    (CENTRE.0 + reach * angle.sin(), CENTRE.1 - reach * angle.cos())
}

/// Decibels of a relative pressure, no more than fit on the sheet.
fn decibels(relative: f64) -> f64 {
    (20.0 * relative.abs().log10()).clamp(FLOOR_DB, HIGHEST_DB)
}

impl Picture for PolarLobe<'_> {
    fn size(&self) -> (u32, u32) {
        SIZE
    }

    fn description(&self) -> String {
        "Polar plot of the pressure relative to the axis, in decibels: readings as dots, fitted lobes as lines.".to_owned()
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        self.grid(canvas)?;
        for bin in self.found.profile.lobe.iter().filter(|bin| bin.value.is_finite()) {
            let degrees = bin.theta_rad.to_degrees();
            for side in [-1.0, 1.0] {
                let at = place(side * degrees, decibels(bin.value));
                Series::Numbered(0).mark_on_curve(canvas, at, true)?;
            }
        }
        let y = f64::from(SIZE.1) - 42.0;
        let mut at = (30.0, y);
        for (number, (pair, _)) in self.found.lobe_laws().into_iter().enumerate() {
            let series = Series::Numbered(number + 1);
            let pen = Pen { colour: series.colour(), width: 2.0 };
            for side in [-1.0, 1.0] {
                let line: Vec<Point> = lobe_of(pair)
                    .into_iter()
                    .filter(|(_, relative)| relative.is_finite())
                    .map(|(degrees, relative)| place(side * degrees, decibels(relative)))
                    .collect();
                canvas.dashed(&line, series.dash(), pen)?;
            }
            let name = pair.lobe_law.to_string();
            canvas.dashed(&[at, (at.0 + 30.0, at.1)], series.dash(), pen)?;
            canvas.text(&name, (at.0 + 36.0, at.1), LABEL_TEXT, Align::Right)?;
            at.0 += 60.0 + 7.6 * name.chars().count() as f64;
            if number == 2 {
                at = (30.0, y + 24.0);
            }
        }
        Ok(())
    }
}
