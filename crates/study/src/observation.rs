//! The figures of one simulated map.

use serde::{Deserialize, Serialize};

use fieldgap_acoustics::metrics::{Convention, PlaneMap, focal_radius, peak, sub_peaks};

/// What one map shows of its focus.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "peak_position", rename_all = "kebab-case")]
pub enum Observation {
    /// The peak is on the map.
    OnMap(MapFigures),
    /// The largest value is on the map's edge: the peak lies outside, and the map says nothing about it.
    OutsideMap,
}

/// How tables name a peak that is not on the map.
pub(super) const OUTSIDE: &str = "outside the map";

/// The figures of one map: lengths in millimetres, pressures in the simulator's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapFigures {
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
}

impl Observation {
    /// The figures of a map without missing points.
    pub(super) fn of(map: &PlaneMap, threshold: f64, convention: Convention) -> Self {
        let top = peak(map).expect("every point is simulated");
        if top.at_edge {
            return Self::OutsideMap;
        }
        let radius = focal_radius(map, threshold, convention).expect("every point is simulated");
        let others = sub_peaks(map, threshold);
        let sides: Vec<String> = radius.cut_off().map(|side| side.to_string()).collect();
        Self::OnMap(MapFigures {
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
        })
    }

    /// The figures; `None` if the peak is outside the map.
    pub fn figures(&self) -> Option<&MapFigures> {
        match self {
            Self::OnMap(figures) => Some(figures),
            Self::OutsideMap => None,
        }
    }
}
