//! A measured plane and its simulation, brought back to the plane of the elements.

use std::f64::consts::TAU;

use super::Picture;
use super::axes::Axes;
use super::colour_scale::ColourScale;
use super::cyclic_scale::phase_colour;
use super::map_layout::MapLayout;
use super::plane_maps::reading_label;
use fieldgap_acoustics::Simulator;
use fieldgap_canvas::{Canvas, CanvasError, Pen, Point, Rgb};
use fieldgap_comparison::Hologram;

/// Outline of an element's face, and of one that stands out.
const FACE: Pen = Pen { colour: (255, 255, 255), width: 0.75 };
const OUTSTANDING: Pen = Pen { colour: (230, 40, 40), width: 2.0 };

/// The three maps.
pub(crate) struct HologramMaps<'a> {
    hologram: &'a Hologram,
    simulator: Simulator,
    unit: &'a str,
    scale: ColourScale,
    layout: MapLayout,
}

impl<'a> HologramMaps<'a> {
    /// The maps of a hologram; `None` where it has no points.
    pub fn new(hologram: &'a Hologram, simulator: Simulator, unit: &'a str) -> Option<Self> {
        let layout = MapLayout::new(&hologram.x_m, &hologram.y_m)?.with_bar_after_second();
        let all = hologram.scan.iter().chain(&hologram.simulation);
        let top = all.copied().fold(0.0, f64::max);
        let scale = ColourScale { top: if top > 0.0 { top } else { 1.0 } };
        Some(Self { hologram, simulator, unit, scale, layout })
    }

    fn colour_of_phase(&self, point: f64) -> Rgb {
        let point = point as usize;
        let share = self.hologram.scan[point].min(self.hologram.simulation[point]) / self.scale.top;
        phase_colour(self.hologram.difference_rad[point], share)
    }

    /// The outlines of the elements.
    fn elements(&self, canvas: &mut Canvas, axes: &Axes) -> Result<(), CanvasError> {
        let outstanding = self.hologram.outstanding();
        let circle = |at_m: [f64; 2], radius_m: f64| -> Vec<Point> {
            // Clockwise on the sheet.
            let turn = |n: i32| f64::from(-n) * TAU / 24.0;
            let [x, y] = at_m.map(|m| m * 1e3);
            let on_rim =
                |n| (x + 1e3 * radius_m * turn(n).cos(), y + 1e3 * radius_m * turn(n).sin());
            (0..24).map(on_rim).map(|(x, y)| axes.place(x, y)).collect()
        };
        for element in &self.hologram.elements {
            canvas.outline(&circle(element.at_m, element.radius_m), FACE)?;
        }
        for element in outstanding {
            canvas.outline(&circle(element.at_m, element.radius_m), OUTSTANDING)?;
        }
        Ok(())
    }
}

impl Picture for HologramMaps<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(3)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(3, width)
    }

    fn description(&self) -> String {
        format!(
            "Three maps in the plane of the elements: the scan brought back from {:.1} mm, the {} simulation brought back in the same way, \
             and the difference of their phases.",
            self.hologram.height_m * 1e3,
            self.simulator
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let colour = |value| self.scale.colour(value);
        for (index, title, values) in [
            (0, "scan, at the elements", &self.hologram.scan),
            (1, "simulation, at the elements", &self.hologram.simulation),
        ] {
            let axes = self.layout.map(canvas, index, title, values, colour)?;
            self.elements(canvas, &axes)?;
        }
        let label = reading_label(self.unit);
        self.layout.colour_bar(canvas, 1, (0.0, self.scale.top), &label, colour)?;
        let points: Vec<f64> = (0..self.hologram.scan.len()).map(|point| point as f64).collect();
        let title = "phase, scan \u{2212} simulation";
        let axes = self.layout.map(canvas, 2, title, &points, |p| self.colour_of_phase(p))?;
        self.elements(canvas, &axes)?;
        let of_degrees = |degrees: f64| phase_colour(degrees.to_radians(), 1.0);
        self.layout.colour_bar(canvas, 2, (-180.0, 180.0), "phase (degrees)", of_degrees)
    }
}
