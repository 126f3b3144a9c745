//! The figures of one simulated map.

use serde::Serialize;

use fieldgap_acoustics::metrics::{Convention, PlaneMap, focal_radius, peak, sub_peaks};

/// The figures of one map: lengths in millimetres, pressures in the simulator's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observation {
    /// Mean half-width at the threshold; `None` if no side falls below it inside the map.
    pub focal_radius_mm: Option<f64>,
    /// Largest value.
    pub peak: f64,
    /// Its position along x.
    pub peak_x_mm: f64,
    /// Its position along y.
    pub peak_y_mm: f64,
    /// Number of local maxima, other than the peak, that reach the threshold.
    pub sub_peaks: usize,
    /// The largest sub-peak, relative to the peak.
    pub largest_sub_peak: Option<f64>,
    /// Sides that the map's edge cuts off and the mean excludes: `+x -x +y -y`.
    pub cut_off: String,
    /// Whether the peak is on the map's edge, so that the true peak may be outside.
    pub peak_at_edge: bool,
}

impl Observation {
    /// The figures of a map without missing points.
    pub(super) fn of(map: &PlaneMap, threshold: f64, convention: Convention) -> Self {
        let top = peak(map).expect("every point is simulated");
        let radius = focal_radius(map, threshold, convention).expect("every point is simulated");
        let others = sub_peaks(map, threshold);
        let sides: Vec<String> = radius.cut_off().map(|side| side.to_string()).collect();
        Self {
            focal_radius_mm: radius.radius_m.map(|radius_m| radius_m * 1e3),
            peak: top.value,
            peak_x_mm: top.x_m * 1e3,
            peak_y_mm: top.y_m * 1e3,
            sub_peaks: others.len(),
            largest_sub_peak: others
                .first()
                .and_then(|&(column, row)| map.at(column, row))
                .map(|value| value / top.value),
            cut_off: sides.join(" "),
            peak_at_edge: top.at_edge,
        }
    }
}
