//! `[fly]`: rows measured in motion at constant speed.

use serde::Deserialize;

use fieldgap_input::{Finite, Length, Speed};

/// How rows are measured in motion.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fly {
    /// Speed at the points.
    pub speed_mm_s: Speed,
    /// Distance before the first point of a row and after its last for acceleration; by default as much as printers usually need.
    pub lead_mm: Option<Length>,
    /// Delay of the readings relative to the robot; by default determined from a row that is measured in both directions.
    pub lag_ms: Option<Finite>,
}
