//! Scan, simulation and their difference at one height, side by side on one colour scale.

use super::Picture;
use super::axes::{Axes, LABEL_TEXT};
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::marker::{Series, focus_on_map};
use fieldgap_acoustics::Simulator;
use fieldgap_canvas::{Align, Canvas, CanvasError, Point};
use fieldgap_comparison::{ComparedMap, FieldFigures, PlaneComparison};

/// Differences below this share of the colour scale carry no sign.
pub(crate) const LEAST_SIGNED_SHARE: f64 = 0.15;

/// The three maps of a plane.
#[derive(Clone)]
pub(crate) struct PlaneMaps<'a> {
    map: &'a ComparedMap,
    plane: &'a PlaneComparison,
    simulator: Simulator,
    unit: &'a str,
    scale: ColourScale,
    layout: MapLayout,
}

impl<'a> PlaneMaps<'a> {
    /// The maps of a plane, the lightest colour for the largest reading of scan and simulation. `None` where the plane has
    /// no map that could be drawn.
    pub fn new(plane: &'a PlaneComparison, simulator: Simulator, unit: &'a str) -> Option<Self> {
        let map = plane.map.as_ref()?;
        let cells = map.x_m.len() * map.y_m.len();
        if cells == 0 || map.scan.len() != cells || map.simulation.len() != cells {
            return None;
        }
        let layout = MapLayout::new(&map.x_m, &map.y_m)?;
        // Where no reading is above zero, any scale shows as much.
        let top =
            largest(map.scan.iter().chain(&map.simulation)).filter(|&top| top > 0.0).unwrap_or(1.0);
        Some(Self { map, plane, simulator, unit, scale: ColourScale { top }, layout })
    }

    /// The same maps one below the other.
    pub fn stacked(mut self) -> Self {
        self.layout = self.layout.stacked();
        self
    }

    /// The focus over this plane, x and y in millimetres, if it is on the map.
    fn focus_mm(&self) -> Option<Point> {
        let focus = self.plane.target_in_scan_m? * 1e3;
        self.layout.panel(0).holds(focus.x, focus.y).then_some((focus.x, focus.y))
    }

    fn panel(
        &self,
        canvas: &mut Canvas,
        index: usize,
        title: &str,
        values: &[f64],
    ) -> Result<Axes, CanvasError> {
        self.layout.map(canvas, index, title, values, |value| self.scale.colour(value))
    }

    /// Marks of focus and peaks on a panel.
    fn marks(
        &self,
        canvas: &mut Canvas,
        axes: &Axes,
        peaks: &[(Series, &FieldFigures)],
    ) -> Result<(), CanvasError> {
        for (series, figures) in peaks {
            if let Some((x, y)) = peak_mm(figures).filter(|&(x, y)| axes.holds(x, y)) {
                series.mark_on_map(canvas, axes.place(x, y))?;
            }
        }
        match self.focus_mm() {
            Some((x, y)) => focus_on_map(canvas, axes.place(x, y)),
            None => Ok(()),
        }
    }

    fn legend(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let entry = |canvas: &mut Canvas, panel: usize, along: f64, text: &str| {
            let y = self.layout.legend_height(3, panel);
            let x = self.layout.panel(panel).corner.0 + along + 8.0;
            canvas.text(text, (x + 17.0, y), LABEL_TEXT, Align::Right)?;
            Ok::<Point, CanvasError>((x, y))
        };
        let at = entry(canvas, 0, 0.0, "peak of the scan")?;
        Series::Scan.mark_on_map(canvas, at)?;
        if self.focus_mm().is_some() {
            let at = entry(canvas, 0, 165.0_f64.min(self.layout.panel_width() - 60.0), "focus")?;
            focus_on_map(canvas, at)?;
        }
        let at = entry(canvas, 1, 0.0, "peak of the simulation")?;
        Series::Simulated(self.simulator).mark_on_map(canvas, at)?;
        let (signs, y) = (self.layout.panel(2).corner.0, self.layout.legend_height(3, 2));
        canvas.text("+ scan louder, \u{2212} scan quieter", (signs, y), LABEL_TEXT, Align::Right)
    }
}

impl Picture for PlaneMaps<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(3)
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        self.layout.fit(3, width)
    }

    fn description(&self) -> String {
        format!(
            "Three maps over x and y at height {:.4} mm: the scan, the {} simulation, and the size of their difference.",
            self.plane.z_m * 1e3,
            self.simulator
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let difference: Vec<f64> =
            self.map.scan.iter().zip(&self.map.simulation).map(|(scan, sim)| scan - sim).collect();
        let size_of_difference: Vec<f64> = difference.iter().map(|value| value.abs()).collect();
        let simulated = Series::Simulated(self.simulator);
        let (scan, simulation) =
            ((Series::Scan, &self.plane.scan), (simulated, &self.plane.simulation));

        let axes = self.panel(canvas, 0, "scan", &self.map.scan)?;
        self.marks(canvas, &axes, &[scan])?;
        let axes = self.panel(canvas, 1, &simulated.name(), &self.map.simulation)?;
        self.marks(canvas, &axes, &[simulation])?;
        let axes = self.panel(canvas, 2, "|scan \u{2212} simulation|", &size_of_difference)?;
        let least = LEAST_SIGNED_SHARE * self.scale.top;
        self.layout
            .signs(canvas, &axes, &difference, least, |value| self.scale.contrast(value.abs()))?;
        self.marks(canvas, &axes, &[simulation, scan])?;
        let range = (0.0, self.scale.top);
        let label = reading_label(self.unit);
        self.layout.colour_bar(canvas, 2, range, &label, |value| self.scale.colour(value))?;
        self.legend(canvas)
    }
}

fn largest<'a>(values: impl Iterator<Item = &'a f64>) -> Option<f64> {
    values.copied().filter(|value| value.is_finite()).reduce(f64::max)
}

/// The position of the peak, x and y in millimetres; `None` where there is none.
fn peak_mm(figures: &FieldFigures) -> Option<Point> {
    let [x, y] = figures.peak_position_m.map(|along| along.value * 1e3);
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

/// The label of an axis of readings.
pub(super) fn reading_label(unit: &str) -> String {
    if unit.is_empty() { "reading".to_owned() } else { format!("reading ({unit})") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Drawn;
    use fieldgap_acoustics::Vec3;
    use fieldgap_comparison::{Agreement, Discrepancy, Uncertain};

    const NOWHERE: Uncertain = Uncertain { value: f64::NAN, standard_error: f64::NAN };

    fn figures(x_m: f64, y_m: f64) -> FieldFigures {
        let at = |value| Uncertain { value, standard_error: 0.0 };
        FieldFigures {
            peak: NOWHERE,
            peak_position_m: [at(x_m), at(y_m)],
            peak_at_edge: false,
            focal_radius: None,
            sub_peaks: None,
        }
    }

    /// A cone of 21 by 11 points, 2 mm apart, its top at (8, -4) mm; the simulation's top is at (-8, 4) mm.
    fn cones() -> PlaneComparison {
        let along =
            |steps: i32| (-steps..=steps).map(|step| f64::from(step) * 2e-3).collect::<Vec<_>>();
        let (x_m, y_m) = (along(10), along(5));
        let cone = |x0: f64, y0: f64| -> Vec<f64> {
            let value = |x: f64, y: f64| (1.0 - 20.0 * (x - x0).hypot(y - y0)).max(0.0);
            y_m.iter().flat_map(|&y| x_m.iter().map(move |&x| value(x, y))).collect()
        };
        let (scan, simulation) = (cone(0.008, -0.004), cone(-0.008, 0.004));
        PlaneComparison {
            focus: 0,
            z_m: 0.1,
            target_m: None,
            target_in_scan_m: Some(Vec3::new(0.0, 0.008, 0.1)),
            map: Some(ComparedMap { x_m, y_m, scan, simulation, phase_rad: None }),
            why_no_map: None,
            scan: figures(0.008, -0.004),
            simulation: figures(-0.008, 0.004),
            discrepancy: Discrepancy {
                peak_ratio: NOWHERE,
                peak_shift_m: [NOWHERE; 2],
                peak_distance_m: NOWHERE,
                focal_radius_m: None,
                sub_peaks: None,
            },
            agreement: Agreement {
                correlation: 0.0,
                residual_rms_ratio: 1.0,
                residual_rms_ratio_own_gain: 1.0,
                gain_ratio: 1.0,
                residual_rms: 1.0,
                scan_rms: 1.0,
                points: 231,
            },
            points: 231,
            phase: None,
        }
    }

    /// The pixel of a drawn picture at a point of the sheet.
    fn pixel(drawn: &Drawn, (x, y): Point) -> (u8, u8, u8) {
        let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
        let image::Rgb([red, green, blue]) = *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
        (red, green, blue)
    }

    #[test]
    fn the_peak_shines_through_its_mark_in_the_lightest_colour() {
        let plane = cones();
        let maps = PlaneMaps::new(&plane, Simulator::Corrected, "V").expect("a map");
        let drawn = Drawn::new(&maps).expect("drawn");
        let scale = ColourScale { top: 1.0 };
        let (scan, simulation) = (maps.layout.panel(0), maps.layout.panel(1));
        assert_eq!(pixel(&drawn, scan.place(8.0, -4.0)), scale.colour(1.0));
        assert_eq!(pixel(&drawn, simulation.place(-8.0, 4.0)), scale.colour(1.0));
        // Half way down the cone, and far from it.
        let along = 20.0 * 0.008;
        assert_eq!(pixel(&drawn, scan.place(16.0, -4.0)), scale.colour(1.0 - along));
        assert_eq!(
            pixel(&drawn, scan.place(-20.0, 10.0)),
            scale.colour(1.0 - 20.0 * 0.028f64.hypot(0.014))
        );
    }

    #[test]
    fn a_millimetre_is_as_long_in_y_as_in_x() {
        let plane = cones();
        let maps = PlaneMaps::new(&plane, Simulator::Piston, "V").expect("a map");
        let axes = maps.layout.panel(2);
        let (origin, right, up) =
            (axes.place(0.0, 0.0), axes.place(10.0, 0.0), axes.place(0.0, 10.0));
        assert!(((right.0 - origin.0) - (origin.1 - up.1)).abs() < 1e-9);
    }

    #[test]
    fn the_focus_is_marked_in_white_where_it_stands() {
        let plane = cones();
        let maps = PlaneMaps::new(&plane, Simulator::Corrected, "V").expect("a map");
        let drawn = Drawn::new(&maps).expect("drawn");
        for panel in 0..3 {
            let at = maps.layout.panel(panel).place(0.0, 8.0);
            assert_eq!(pixel(&drawn, at), (255, 255, 255), "panel {panel}");
        }
    }

    #[test]
    fn maps_of_the_wrong_size_or_of_nothing_are_not_drawn() {
        let mut plane = cones();
        plane.map.as_mut().expect("a map").scan.pop();
        assert!(PlaneMaps::new(&plane, Simulator::Corrected, "V").is_none());
        let nothing = || Vec::new();
        plane.map = Some(ComparedMap {
            x_m: nothing(),
            y_m: nothing(),
            scan: nothing(),
            simulation: nothing(),
            phase_rad: None,
        });
        assert!(PlaneMaps::new(&plane, Simulator::Corrected, "V").is_none());
    }

    #[test]
    fn a_single_row_of_points_is_drawn_too() {
        let mut plane = cones();
        let map = plane.map.as_mut().expect("a map");
        map.y_m = vec![0.0];
        map.scan.truncate(21);
        map.simulation.truncate(21);
        let maps = PlaneMaps::new(&plane, Simulator::Corrected, "V").expect("a map");
        assert!(Drawn::new(&maps).is_ok());
    }
}
