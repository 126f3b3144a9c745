//! The phase of a scan less that of its simulation, in one plane.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::cyclic_scale::{FADES_BELOW, phase_colour};
use super::map_layout::MapLayout;
use fieldgap_acoustics::Simulator;
use fieldgap_canvas::{Align, Canvas, CanvasError, Rgb};
use fieldgap_comparison::{ComparedMap, PlaneComparison, PlanePhase};
use fieldgap_text::{fixed, height_mm};

/// The map of a plane.
pub(crate) struct PhaseMap<'a> {
    map: &'a ComparedMap,
    phase: &'a PlanePhase,
    z_m: f64,
    simulator: Simulator,
    top: f64,
    layout: MapLayout,
}

impl<'a> PhaseMap<'a> {
    /// The map of a plane; `None` where it has no phases.
    pub fn new(plane: &'a PlaneComparison, simulator: Simulator) -> Option<Self> {
        let (map, phase) = (plane.map.as_ref()?, plane.phase.as_ref()?);
        let layout = MapLayout::new(&map.x_m, &map.y_m)?;
        let top = map.scan.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
        let top = if top > 0.0 { top } else { 1.0 };
        Some(Self { map, phase, z_m: plane.z_m, simulator, top, layout })
    }

    /// The colour of the difference at a point, by its number.
    fn colour(&self, point: f64) -> Rgb {
        let point = point as usize;
        phase_colour(self.phase.difference_rad[point], self.map.scan[point] / self.top)
    }
}

impl Picture for PhaseMap<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(1)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(1, width)
    }

    fn description(&self) -> String {
        format!(
            "A map over x and y at height {} mm: the phase of the scan less that of the {} simulation.",
            height_mm(self.z_m),
            self.simulator
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        // The colour depends on phase and amplitude, so that a cell's number stands for both; what was not measured is no number.
        let differences = self.phase.difference_rad.iter().enumerate();
        let points: Vec<f64> = differences
            .map(|(point, difference)| if difference.is_nan() { f64::NAN } else { point as f64 })
            .collect();
        let title = "phase, scan \u{2212} simulation";
        let axes = self.layout.map(canvas, 0, title, &points, |point| self.colour(point))?;
        let of_degrees = |degrees: f64| phase_colour(degrees.to_radians(), 1.0);
        self.layout.colour_bar(canvas, 0, (-180.0, 180.0), "phase (degrees)", of_degrees)?;
        let fades = format!("fades below {}\u{a0}% of the largest", fixed(100.0 * FADES_BELOW, 0));
        let at = (axes.corner.0, self.layout.legend_height(1, 0));
        canvas.text(&fades, at, LABEL_TEXT, Align::Right)
    }
}
