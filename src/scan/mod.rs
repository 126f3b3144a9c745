//! Records of fields: recorded scans, plans of scans to come, the journal of a scan that is running, and
//! imports of fields measured elsewhere.

mod array_section;
mod array_table;
mod elements_csv;
mod focus_section;
mod medium_section;
mod sample;
mod samples_csv;
mod section;
mod setup;
mod table;

pub use array_section::{ArraySection, Layout, Rims};
pub use array_table::ArrayTable;
pub use elements_csv::{read_elements, write_elements};
pub use focus_section::{FocusSection, FocusTable, WrongPhaseCount};
pub use medium_section::{MediumSection, MediumTable};
pub use sample::{Sample, Spread};
pub use samples_csv::{Columns, SpreadMismatch, read_samples, write_samples};
pub use setup::{ScanSetup, UnwritableSetup};
