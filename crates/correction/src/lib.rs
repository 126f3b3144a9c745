//! Set-up files corrected by what a diagnosis found, so that the next simulation includes it.
//!
//! A rig file is corrected for future scans: the drives follow from its corrected set-up. In a recorded scan the drives that
//! the array emitted are kept, as phases, and only the set-up is corrected. An effect without a key in these files is named,
//! with what to do instead.
//!
//! | file | what it does |
//! |---|---|
//! | `change` | the changes of a set-up that follow from the named cause |
//! | `not_correctable` | effects without a key in a set-up file, and why |
//! | `elements` | changes of single elements |
//! | `document` | TOML edited in place, comments kept |
//! | `changed_key` | the keys of a file that change |
//! | `planned` | a correction before it is written |
//! | `rig_file`, `recorded_scan` | the two kinds of set-up |

mod change;
mod changed_key;
mod document;
mod elements;
mod error;
mod not_correctable;
mod planned;
mod recorded_scan;
mod rig_file;

pub use changed_key::ChangedKey;
pub use error::CorrectionError;
pub use not_correctable::Unwritten;
pub use planned::{Corrected, PlannedCorrection};
pub use recorded_scan::{correct_recorded_scan, plan_recorded_scan};
pub use rig_file::{correct_rig_file, plan_rig_file};
