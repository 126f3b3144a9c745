//! The scan at one height, and its residuals before and after the simulation was corrected.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::marker::Series;
use super::noise_scale;
use super::plane_maps::reading_label;
use fieldgap_canvas::{Align, Canvas, CanvasError};
use fieldgap_diagnosis::DiagnosedPlane;

/// Residuals carry a sign from here on, standard deviations: noise alone seldom reaches it.
pub(crate) const LEAST_SIGNED_SIGMA: f64 = 3.0;

/// Three maps of a plane.
#[derive(Clone)]
pub(crate) struct ResidualMaps<'a> {
    plane: &'a DiagnosedPlane,
    unit: &'a str,
    readings: ColourScale,
    layout: MapLayout,
}

impl<'a> ResidualMaps<'a> {
    /// The maps of a plane; `None` where its points lie on no grid.
    pub fn new(plane: &'a DiagnosedPlane, unit: &'a str) -> Option<Self> {
        let layout = MapLayout::new(&plane.x_m, &plane.y_m)?.with_bar_after_first();
        let cells = plane.x_m.len() * plane.y_m.len();
        let maps = [&plane.measured, &plane.residual_before, &plane.residual_after];
        if maps.iter().any(|map| map.len() != cells) {
            return None;
        }
        let finite = plane.measured.iter().copied().filter(|reading| reading.is_finite());
        // Where no reading is above zero, any scale shows as much.
        let top = finite.reduce(f64::max).filter(|&top| top > 0.0).unwrap_or(1.0);
        Some(Self { plane, unit, readings: ColourScale { top }, layout })
    }

    /// The same with its panels one below the other.
    pub fn stacked(mut self) -> Self {
        self.layout = self.layout.stacked();
        self
    }
}

/// Root mean square of the finite ones among some values; `None` where there is none.
pub(crate) fn rms(values: &[f64]) -> Option<f64> {
    let finite = values.iter().filter(|value| value.is_finite());
    let (count, sum) =
        finite.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

impl Picture for ResidualMaps<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(3)
    }

    fn description(&self) -> String {
        let residual_rms = |values: &[f64]| {
            rms(values).map_or("nothing measured".to_owned(), |rms| format!("{rms:.2}"))
        };
        format!(
            "Three maps over x and y at height {:.4} mm: the scan, and scan minus simulation in standard deviations of the \
             noise, for the nominal simulation (root mean square {}) and for the corrected one ({}).",
            self.plane.z_mm,
            residual_rms(&self.plane.residual_before),
            residual_rms(&self.plane.residual_after)
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let reading = |value| self.readings.colour(value);
        let axes = self.layout.map(canvas, 0, "scan", &self.plane.measured, reading)?;
        if let Some([scan, ..]) = &self.plane.figures {
            let [x, y] = scan.peak_position_m.map(|along| along.value * 1e3);
            if axes.holds(x, y) {
                Series::Scan.mark_on_map(canvas, axes.place(x, y))?;
            }
        }
        let range = (0.0, self.readings.top);
        self.layout.colour_bar(canvas, 0, range, &reading_label(self.unit), reading)?;
        for (panel, title, values) in [
            (1, "scan \u{2212} nominal simulation", &self.plane.residual_before),
            (2, "scan \u{2212} corrected simulation", &self.plane.residual_after),
        ] {
            let axes = self.layout.map(canvas, panel, title, values, noise_scale::colour)?;
            let contrast = noise_scale::contrast;
            self.layout.signs(canvas, &axes, values, LEAST_SIGNED_SIGMA, contrast)?;
        }
        let (label, colour) = ("residual (σ of the noise)", noise_scale::colour_along);
        self.layout.marked_bar(canvas, 2, &noise_scale::marks(), label, colour)?;
        let (x, y) = (self.layout.panel(0).corner.0, self.layout.legend_height(3, 0));
        Series::Scan.mark_on_map(canvas, (x + 8.0, y))?;
        canvas.text("peak of the scan", (x + 25.0, y), LABEL_TEXT, Align::Right)?;
        let (x, y) = (self.layout.panel(1).corner.0, self.layout.legend_height(3, 1));
        let words =
            format!("+ scan louder, \u{2212} scan quieter, by more than {LEAST_SIGNED_SIGMA} σ");
        canvas.text(&words, (x, y), LABEL_TEXT, Align::Right)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;

    fn plane() -> DiagnosedPlane {
        DiagnosedPlane {
            scan: 0,
            focus: 0,
            z_mm: 100.0,
            x_m: vec![-0.002, 0.0, 0.002],
            y_m: vec![-0.001, 0.001],
            measured: vec![1.0, 2.0, 1.0, f64::NAN, 1.0, 0.5],
            before: vec![1.0; 6],
            after: vec![1.0; 6],
            residual_before: vec![0.0, 50.0, 0.0, f64::NAN, -2.5, 0.0],
            residual_after: vec![0.0; 6],
            figures: None,
        }
    }

    #[test]
    fn a_residual_has_the_colour_of_its_size_on_every_picture() {
        let plane = plane();
        let maps = ResidualMaps::new(&plane, "V").expect("a map");
        let drawn = Drawn::new(&maps).expect("drawn");
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let pixel = |panel: usize, x_mm: f64, y_mm: f64| {
            let (x, y) = maps.layout.panel(panel).place(x_mm, y_mm);
            // Off the centre of the cell, where a sign may stand.
            let image::Rgb([red, green, blue]) =
                *image.get_pixel((2.0 * x) as u32 + 30, (2.0 * y) as u32 + 30);
            (red, green, blue)
        };
        assert_eq!(pixel(1, 0.0, -1.0), noise_scale::colour(50.0));
        assert_eq!(pixel(1, 0.0, 1.0), noise_scale::colour(-2.5));
        assert_eq!(pixel(2, 0.0, -1.0), noise_scale::colour(0.0));
        assert!(drawn.description.contains("(root mean square 22.39)"), "{}", drawn.description);
    }

    #[test]
    fn points_on_no_grid_have_no_map() {
        let mut plane = plane();
        plane.residual_after.pop();
        assert!(ResidualMaps::new(&plane, "V").is_none());
        plane.x_m.clear();
        assert!(ResidualMaps::new(&plane, "V").is_none());
    }
}
