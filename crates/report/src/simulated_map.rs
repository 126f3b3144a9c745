//! The simulated field over one plane.

use fieldgap_acoustics::{PlaneGrid, Vec3};

/// One simulated plane.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedMap {
    /// Number of the drive, from 0.
    pub drive: usize,
    /// The points.
    pub grid: PlaneGrid,
    /// Root mean square pressure, row by row, zero or above, in the simulator's arbitrary unit.
    pub amplitude: Vec<f64>,
    /// Phase of the complex pressure at the same points, radians.
    pub phase_rad: Vec<f64>,
    /// The focus of the drive, metres, if it has one.
    pub focus_m: Option<Vec3>,
}
