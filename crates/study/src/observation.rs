//! What is read off one simulated map.

use serde::Serialize;

use fieldgap_acoustics::metrics::{Convention, PlaneMap, focal_radius, peak, sub_peaks};

/// The figures of one map: lengths in millimetres, pressures in the simulator's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observation {
    /// Mean half-width at the threshold; none where no side falls below it inside the map.
    pub focal_radius_mm: Option<f64>,
    /// Largest value.
    pub peak: f64,
    /// Where it stands.
    pub peak_x_mm: f64,
    /// Where it stands.
    pub peak_y_mm: f64,
    /// Local maxima beside the peak that reach the threshold.
    pub sub_peaks: usize,
    /// The largest of them, relative to the peak.
    pub largest_sub_peak: Option<f64>,
    /// The sides that the map's edge cuts off, and that are not in the mean: `+x -x +y -y`.
    pub cut_off: String,
    /// Whether the peak lies on the map's edge, and may in truth lie beyond.
    pub peak_at_edge: bool,
}

impl Observation {
    /// Reads a map on which every point is simulated.
    pub(super) fn of(map: &PlaneMap, threshold: f64, convention: Convention) -> Self {
        let top = peak(map).expect("every point is simulated");
        let radius = focal_radius(map, threshold, convention).expect("every point is simulated");
        let beside = sub_peaks(map, threshold);
        let sides: Vec<String> = radius.cut_off().map(|side| side.to_string()).collect();
        Self {
            focal_radius_mm: radius.radius_m.map(|radius_m| radius_m * 1e3),
            peak: top.value,
            peak_x_mm: top.x_m * 1e3,
            peak_y_mm: top.y_m * 1e3,
            sub_peaks: beside.len(),
            largest_sub_peak: beside
                .first()
                .and_then(|&(column, row)| map.at(column, row))
                .map(|value| value / top.value),
            cut_off: sides.join(" "),
            peak_at_edge: top.at_edge,
        }
    }
}
