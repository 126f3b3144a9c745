//! Two records at one height on one colour scale, and their difference in standard errors.

use super::Picture;
use super::axes::LABEL_TEXT;
use super::colour_scale::ColourScale;
use super::map_layout::MapLayout;
use super::marker::Series;
use super::noise_scale;
use super::plane_maps::reading_label;
use super::residual_maps::{LEAST_SIGNED_SIGMA, rms};
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_canvas::{Align, Canvas, CanvasError};
use fieldgap_comparison::{FieldFigures, HeightChange, PlaceChange};
use fieldgap_records::{OFF_LINE_MM, Plane, RecordedSample, plane_map};

/// The mark of the second record's peak: another shape and colour than that of the first.
const SECOND: Series = Series::Simulated(Simulator::Corrected);

/// Lines of a grid at most, where places lie on none.
const MOST_LINES: f64 = 400.0;

/// Three maps of a height.
#[derive(Clone)]
pub(crate) struct ChangeMaps<'a> {
    height: &'a HeightChange,
    unit: &'a str,
    a: Vec<f64>,
    b: Vec<f64>,
    difference: Vec<f64>,
    readings: ColourScale,
    layout: MapLayout,
}

/// Common places as a grid: its lines, and for each of its points the number of the place there.
struct Grid {
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    places: Vec<Option<usize>>,
}

impl Grid {
    fn of(places: &[PlaceChange]) -> Option<Self> {
        Self::as_recorded(places).or_else(|| Self::nearest(places))
    }

    /// The grid that the places lie on.
    fn as_recorded(places: &[PlaceChange]) -> Option<Self> {
        let samples: Vec<RecordedSample> = places
            .iter()
            .enumerate()
            .map(|(n, place)| RecordedSample::measured(0.0, Some(0), place.at_m, n as f64, None))
            .collect();
        let plane = Plane { focus: 0, z_mm: 0.0, samples: samples.iter().collect() };
        let map = plane_map(&plane, OFF_LINE_MM).ok()?.map;
        let number = |value: &f64| value.is_finite().then(|| value.round() as usize);
        Some(Self {
            x_m: map.x_m().to_vec(),
            y_m: map.y_m().to_vec(),
            places: map.values().iter().map(number).collect(),
        })
    }

    /// A grid of as many points over the same area, for places that were turned: each shows the nearest place.
    fn nearest(places: &[PlaceChange]) -> Option<Self> {
        let range = |axis: usize| {
            let along = places.iter().map(|place| place.at_m[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
                (low.min(m), high.max(m))
            })
        };
        let [(left, right), (low, high)] = [0, 1].map(range);
        let first = places.first()?.at_m;
        let others = places.iter().skip(1).map(|place| (place.at_m - first).norm());
        let step_m = others.fold(f64::INFINITY, f64::min);
        if !(step_m > 0.0 && step_m.is_finite()) {
            return None;
        }
        let lines = |from: f64, to: f64| -> Vec<f64> {
            let count = ((to - from) / step_m).round().min(MOST_LINES) as usize;
            (0..=count).map(|n| from + n as f64 * step_m).collect()
        };
        let (x_m, y_m) = (lines(left, right), lines(low, high));
        let nearest = |x: f64, y: f64| {
            let apart = |place: &PlaceChange| (place.at_m - Vec3::new(x, y, place.at_m.z)).norm();
            let found = places.iter().map(apart).enumerate();
            let found = found.min_by(|one, other| one.1.total_cmp(&other.1))?;
            (found.1 < 0.75 * step_m).then_some(found.0)
        };
        let places = y_m.iter().flat_map(|&y| x_m.iter().map(move |&x| nearest(x, y))).collect();
        Some(Self { places, x_m, y_m })
    }
}

impl<'a> ChangeMaps<'a> {
    /// The maps of a height; `None` where there are too few places for a map.
    pub fn new(height: &'a HeightChange, unit: &'a str) -> Option<Self> {
        // Places on one line are no map.
        let grid =
            Grid::of(&height.places).filter(|grid| grid.x_m.len().min(grid.y_m.len()) > 1)?;
        let layout = MapLayout::new(&grid.x_m, &grid.y_m)?.with_bar_after_second();
        let values = |of: fn(&PlaceChange) -> f64| -> Vec<f64> {
            let value = |place: &Option<usize>| place.map_or(f64::NAN, |n| of(&height.places[n]));
            grid.places.iter().map(value).collect()
        };
        let (a, b) = (values(|place| place.a), values(|place| place.b));
        let both = a.iter().chain(&b).copied().filter(|reading| reading.is_finite());
        // Where no reading is above zero, any scale shows as much.
        let top = both.reduce(f64::max).filter(|&top| top > 0.0).unwrap_or(1.0);
        let difference = values(PlaceChange::in_standard_errors);
        Some(Self { height, unit, a, b, difference, readings: ColourScale { top }, layout })
    }

    /// The same with its panels one below the other.
    pub fn stacked(mut self) -> Self {
        self.layout = self.layout.stacked();
        self
    }
}

impl Picture for ChangeMaps<'_> {
    fn size(&self) -> (u32, u32) {
        self.layout.size(3)
    }

    fn description(&self) -> String {
        let size = rms(&self.difference)
            .map_or("nothing in common".to_owned(), |rms| format!("root mean square {rms:.2}"));
        format!(
            "Three maps over x and y at height {:.4} mm: record A, record B on the same scale, and B minus A in standard errors ({size}; noise \
             alone: 1).",
            self.height.z_m * 1e3
        )
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        let reading = |value| self.readings.colour(value);
        let panels = [
            (0, "A", &self.a, Series::Scan, &self.height.a_figures),
            (1, "B", &self.b, SECOND, &self.height.b_figures),
        ];
        for (panel, title, values, series, figures) in panels {
            let axes = self.layout.map(canvas, panel, title, values, reading)?;
            if let Some((x, y)) = figures.as_ref().and_then(peak_mm)
                && axes.holds(x, y)
            {
                series.mark_on_map(canvas, axes.place(x, y))?;
            }
        }
        let range = (0.0, self.readings.top);
        self.layout.colour_bar(canvas, 1, range, &reading_label(self.unit), reading)?;
        let axes =
            self.layout.map(canvas, 2, "B \u{2212} A", &self.difference, noise_scale::colour)?;
        let contrast = noise_scale::contrast;
        self.layout.signs(canvas, &axes, &self.difference, LEAST_SIGNED_SIGMA, contrast)?;
        let (label, colour) = ("difference (standard errors)", noise_scale::colour_along);
        self.layout.marked_bar(canvas, 2, &noise_scale::marks(), label, colour)?;
        for (panel, series, words) in [(0, Series::Scan, "peak of A"), (1, SECOND, "peak of B")] {
            let (x, y) = (self.layout.panel(panel).corner.0, self.layout.legend_height(3, panel));
            series.mark_on_map(canvas, (x + 8.0, y))?;
            canvas.text(words, (x + 25.0, y), LABEL_TEXT, Align::Right)?;
        }
        let (x, y) = (self.layout.panel(2).corner.0, self.layout.legend_height(3, 2));
        let words = format!("+ B louder, \u{2212} B quieter, beyond {LEAST_SIGNED_SIGMA} errors");
        canvas.text(&words, (x, y), LABEL_TEXT, Align::Right)
    }
}

/// The position of a peak, x and y in millimetres; `None` where there is none.
fn peak_mm(figures: &FieldFigures) -> Option<(f64, f64)> {
    let [x, y] = figures.peak_position_m.map(|along| along.value * 1e3);
    (x.is_finite() && y.is_finite()).then_some((x, y))
}

#[cfg(test)]
mod tests {
    use super::super::Drawn;
    use super::*;
    use fieldgap_comparison::{ChangeFigures, Uncertain};

    /// A height whose places are turned by this angle; B is two errors above A at one place alone.
    fn height(turn_rad: f64) -> HeightChange {
        let (sin, cos) = turn_rad.sin_cos();
        let places = (0..81).map(|n| {
            let (x, y) = (f64::from(n % 9 - 4) * 2e-3, f64::from(n / 9 - 4) * 2e-3);
            PlaceChange {
                at_m: Vec3::new(cos * x - sin * y, sin * x + cos * y, 0.1),
                a: 1.0,
                b: if n == 40 { 1.2 } else { 1.0 },
                a_error: 0.06,
                b_error: 0.08,
                interpolated: true,
            }
        });
        let nothing = Uncertain { value: f64::NAN, standard_error: f64::NAN };
        HeightChange {
            focus: 0,
            z_m: 0.1,
            figures: ChangeFigures {
                points: 81,
                interpolated: 81,
                gain: nothing,
                gap: 0.0,
                correlation: 1.0,
                chi_square_per_point: 1.0,
                beyond_three: 0.0,
            },
            interpolation_error: None,
            a_figures: None,
            b_figures: None,
            places: places.collect(),
        }
    }

    #[test]
    fn the_difference_has_the_colour_of_its_size_also_where_the_places_are_turned() {
        for turn_rad in [0.0, 0.3] {
            let height = height(turn_rad);
            let maps = ChangeMaps::new(&height, "V").expect("a map");
            let drawn = Drawn::new(&maps).expect("drawn");
            let image = image::load_from_memory(&drawn.png).expect("a PNG").to_rgb8();
            let (x, y) = maps.layout.panel(2).place(0.0, 0.0);
            let image::Rgb([red, green, blue]) =
                *image.get_pixel((2.0 * x) as u32, (2.0 * y) as u32);
            assert_eq!((red, green, blue), noise_scale::colour(2.0), "{turn_rad}");
            assert!(drawn.description.contains("root mean square 0.22"), "{}", drawn.description);
        }
    }

    #[test]
    fn places_on_one_line_have_no_map() {
        let mut height = height(0.0);
        height.places.truncate(9);
        assert!(ChangeMaps::new(&height, "V").is_none());
    }
}
