//! A plane of a map that was made of readings: its amplitude with the places of the readings, and its standard error.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::plane_maps::reading_label;
use crate::measured_map::MeasuredMap;
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Rgb};

/// Half the length of the strokes that mark a reading, CSS pixels.
const MARK: f64 = 2.2;

/// Two maps of a plane.
#[derive(Clone)]
pub(crate) struct MeasuredMaps<'a> {
    plane: &'a MeasuredMap,
    unit: &'a str,
    amplitude: ColourScale,
    error: ColourScale,
    layout: MapLayout,
}

impl<'a> MeasuredMaps<'a> {
    /// The maps of a plane, the lightest colours for these amplitude and standard error. `None` where the plane is no map.
    pub fn new(plane: &'a MeasuredMap, unit: &'a str, tops: [f64; 2]) -> Option<Self> {
        let cells = plane.grid.x_m.len() * plane.grid.y_m.len();
        if plane.amplitude.len() != cells || plane.standard_error.len() != cells {
            return None;
        }
        let layout = MapLayout::new(&plane.grid.x_m, &plane.grid.y_m)?.with_bar_after_first();
        let [amplitude, error] = tops.map(|top| ColourScale { top });
        Some(Self { plane, unit, amplitude, error, layout })
    }
}

impl Picture for MeasuredMaps<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(2)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(2, width)
    }

    fn description(&self) -> String {
        format!(
            "Two maps over x and y at height {:.4} mm: the amplitude with the places of {} readings, and its standard error.",
            self.plane.grid.z_m * 1e3,
            self.plane.readings_m.len()
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let amplitude = |value| self.amplitude.colour(value);
        let axes = self.layout.map(canvas, 0, "amplitude", &self.plane.amplitude, amplitude)?;
        let cross = |canvas: &mut Canvas, x: f64, y: f64, colour: Rgb, width: f64| {
            let pen = Pen { colour, width };
            canvas.line((x - MARK, y), (x + MARK, y), pen)?;
            canvas.line((x, y - MARK), (x, y + MARK), pen)
        };
        for at_m in &self.plane.readings_m {
            let (x_mm, y_mm) = (at_m.x * 1e3, at_m.y * 1e3);
            if axes.holds(x_mm, y_mm) {
                let (x, y) = axes.place(x_mm, y_mm);
                // White in black, visible on every colour.
                cross(canvas, x, y, (0, 0, 0), 2.2)?;
                cross(canvas, x, y, (255, 255, 255), 1.0)?;
            }
        }
        let label = reading_label(self.unit);
        self.layout.colour_bar(canvas, 0, (0.0, self.amplitude.top), &label, amplitude)?;
        let error = |value| self.error.colour(value);
        self.layout.map(canvas, 1, "standard error", &self.plane.standard_error, error)?;
        let label = format!("standard error ({})", self.unit);
        self.layout.colour_bar(canvas, 1, (0.0, self.error.top), &label, error)?;
        let at = (self.layout.panel(0).corner.0, self.layout.legend_height(2, 0));
        canvas.text("+ a reading", at, LABEL_TEXT, Align::Right)
    }
}
