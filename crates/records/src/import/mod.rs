//! Import of fields in other formats as recorded scans.

mod grid_csv;
mod thesis_log;

pub use grid_csv::{Anchor, FirstRow, GridCsv, GridPlacement};
pub use thesis_log::{ThesisLog, ThesisLogSetup, TransducerAxis};

/// Assumed time from one point to the next where none was recorded, seconds. It keeps the order of the points and has no other meaning.
pub const MADE_UP_SECONDS_A_POINT: f64 = 1.0;
