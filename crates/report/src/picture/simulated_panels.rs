//! Amplitude and phase of a simulated section, side by side.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::colour_scale::ColourScale;
use super::cyclic_scale::{FADES_BELOW, phase_colour};
use super::map_layout::MapLayout;
use super::marker::focus_on_map;
use crate::simulated_section::SimulatedSection;
use fieldgap_acoustics::Simulator;
use fieldgap_canvas::{Align, Canvas, CanvasError, Rgb};
use fieldgap_text::fixed;

/// The two maps.
pub(crate) struct SimulatedPanels<'a> {
    section: &'a SimulatedSection,
    simulator: Simulator,
    scale: ColourScale,
    layout: MapLayout,
}

impl<'a> SimulatedPanels<'a> {
    /// The maps of a section; `None` for one without points.
    pub fn new(section: &'a SimulatedSection, simulator: Simulator) -> Option<Self> {
        let layout = MapLayout::new(&section.across_m, &section.up_m)?
            .with_bar_after_first()
            .with_labels(section.plane.labels());
        let top = section.amplitude.iter().copied().fold(0.0, f64::max);
        let scale = ColourScale { top: if top > 0.0 { top } else { 1.0 } };
        Some(Self { section, simulator, scale, layout })
    }

    /// The colour of the phase at a point, by its number.
    fn phase(&self, point: f64) -> Rgb {
        let point = point as usize;
        phase_colour(self.section.phase_rad[point], self.section.amplitude[point] / self.scale.top)
    }

    fn mark(&self, canvas: &mut Canvas, axes: &Axes) -> Result<(), CanvasError> {
        match self.section.focus_mm().filter(|&(across, up)| axes.holds(across, up)) {
            Some((across, up)) => focus_on_map(canvas, axes.place(across, up)),
            None => Ok(()),
        }
    }
}

impl Picture for SimulatedPanels<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(2)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(2, width)
    }

    fn description(&self) -> String {
        format!(
            "Two maps of the plane {}: amplitude and phase of the {} simulation.",
            self.section.place(),
            self.simulator
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let colour = |value| self.scale.colour(value);
        let title = format!("amplitude, {}", self.section.place());
        let axes = self.layout.map(canvas, 0, &title, &self.section.amplitude, colour)?;
        self.mark(canvas, &axes)?;
        let range = (0.0, self.scale.top);
        self.layout.colour_bar(canvas, 0, range, "pressure (simulator's unit)", colour)?;
        // The colour of a phase depends on the amplitude too, so that a cell's number stands for both.
        let points: Vec<f64> =
            (0..self.section.phase_rad.len()).map(|point| point as f64).collect();
        let axes = self.layout.map(canvas, 1, "phase", &points, |point| self.phase(point))?;
        self.mark(canvas, &axes)?;
        let of_degrees = |degrees: f64| phase_colour(degrees.to_radians(), 1.0);
        self.layout.colour_bar(canvas, 1, (-180.0, 180.0), "phase (degrees)", of_degrees)?;
        if self.section.focus_mm().is_some_and(|(across, up)| axes.holds(across, up)) {
            let (x, y) = (self.layout.panel(0).corner.0 + 8.0, self.layout.legend_height(2, 0));
            focus_on_map(canvas, (x, y))?;
            canvas.text("focus", (x + 17.0, y), LABEL_TEXT, Align::Right)?;
        }
        let at = (axes.corner.0, self.layout.legend_height(2, 1));
        let fades = format!("fades below {}\u{a0}% of the largest", fixed(100.0 * FADES_BELOW, 0));
        canvas.text(&fades, at, LABEL_TEXT, Align::Right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Drawn;
    use crate::simulated_section::SectionPlane;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn amplitude_and_phase_have_their_colours_and_silence_is_white() {
        let section = SimulatedSection {
            plane: SectionPlane::Xz,
            across_m: vec![0.0, 0.01],
            up_m: vec![0.0, 0.01],
            at_m: -0.0225,
            amplitude: vec![2.0, 1.0, 0.0, 2.0],
            phase_rad: vec![0.0, 2.0, 1.0, -2.0],
            focus_m: Some(Vec3::new(0.001, -0.0225, 0.002)),
        };
        let panels = SimulatedPanels::new(&section, Simulator::Piston).expect("points");
        let drawn = Drawn::new(&panels).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |panel: usize, x_mm: f64, y_mm: f64| {
            let (x, y) = panels.layout.panel(panel).place(x_mm, y_mm);
            let image::Rgb([red, green, blue]) =
                *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
            (red, green, blue)
        };
        assert_eq!(pixel(0, 10.0, 0.0), panels.scale.colour(1.0));
        assert_eq!(pixel(1, 0.0, 0.0), phase_colour(0.0, 1.0));
        assert_eq!(pixel(1, 10.0, 10.0), phase_colour(-2.0, 1.0));
        assert_eq!(pixel(1, 0.0, 10.0), (255, 255, 255));
        for label in
            ["phase (degrees)", "x (mm)", "z (mm)", "amplitude, y = \u{2212}22.5 mm", "focus"]
        {
            assert!(drawn.svg.contains(label), "{label}");
        }
        assert!(!drawn.svg.contains("y (mm)"));
    }
}
