//! `[fly]`: rows gone at constant speed, the receiver listening all the way.

use serde::Deserialize;

use fieldgap_input::{Finite, Positive};

/// How rows are flown over.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fly {
    /// Speed over the points.
    pub speed_mm_s: Positive,
    /// Way before the first point of a row and behind its last, in which the robot speeds up and slows down; without it, as much
    /// as printers usually need.
    pub lead_mm: Option<Positive>,
    /// How far the readings lag behind the robot; without it, it is found from a row that is flown there and back.
    pub lag_ms: Option<Finite>,
}
