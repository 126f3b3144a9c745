//! What to measure next.
//!
//! - [`next_measurement`]: the scan that separates two rivals best.
//! - [`found_field`]: the field that a set expects, with its derivatives.
//! - [`outlook`]: what each set of effects expects of readings that could be taken next.
//! - [`distinguish`]: which effects a scan can separate at all, whatever its readings.

pub mod distinguish;
mod extent;
pub mod found_field;
pub mod next_measurement;
pub mod outlook;
