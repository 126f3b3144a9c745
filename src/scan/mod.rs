//! Records of fields: recorded scans, plans of scans to come, the journal of a scan that is running, and
//! imports of fields measured elsewhere.

mod sample;
mod samples_csv;
mod table;

pub use sample::{Sample, Spread};
pub use samples_csv::{Columns, SpreadMismatch, read_samples, write_samples};
