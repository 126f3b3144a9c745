//! Fields measured elsewhere, brought in as recorded scans.

mod grid_csv;
mod thesis_log;

pub use grid_csv::{Anchor, FirstRow, GridCsv, GridPlacement};
pub use thesis_log::{ThesisLog, ThesisLogSetup, TransducerAxis};

/// Time from one point to the next where none was recorded, seconds. Made up: it keeps the order of the points, and
/// says nothing about drift.
pub const MADE_UP_SECONDS_A_POINT: f64 = 1.0;
