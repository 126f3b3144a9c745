//! What to measure next.
//!
//! - [`next_measurement`]: the scan that separates two rivals best.
//! - [`distinguish`]: which effects a scan can separate at all, whatever its readings.

pub mod distinguish;
mod extent;
pub mod next_measurement;
