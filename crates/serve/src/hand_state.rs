//! The rig under hand, as the pages show it.

use fieldgap_rig::Reading;
use serde::Serialize;

/// What the pages show of the rig under hand.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct HandState {
    /// Whether its devices are open.
    pub open: bool,
    /// Place in the array frame, mm; `None` before homing and after a stop.
    pub at_mm: Option<[f64; 3]>,
    /// Reading of the receiver, and its unit.
    pub level: Option<f64>,
    pub unit: String,
    /// The focus while the array emits, array frame, mm.
    pub focus_mm: Option<[f64; 3]>,
    /// Seconds until the array is silenced.
    pub seconds_left: Option<u64>,
    /// The last reading that was asked for.
    pub sample: Option<Reading>,
    /// The beam axis that was found last, in words.
    pub axis: Option<String>,
    /// What the robot does.
    pub doing: String,
    /// The last refusal or failure.
    pub problem: Option<String>,
}
