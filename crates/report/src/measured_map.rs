//! A map that was made of readings.

use fieldgap_acoustics::{PlaneGrid, Vec3};

/// One plane of a map that was made of readings.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredMap {
    /// Number of the drive, from 0.
    pub drive: usize,
    /// The points.
    pub grid: PlaneGrid,
    /// Amplitude, row by row, zero or above, in the unit of the readings.
    pub amplitude: Vec<f64>,
    /// Standard error at the same points, in the same unit.
    pub standard_error: Vec<f64>,
    /// Where readings were taken in this plane with this drive, metres.
    pub readings_m: Vec<Vec3>,
}
