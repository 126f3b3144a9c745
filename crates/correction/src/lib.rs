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
//! | `rig_file`, `recorded_scan` | the two kinds of set-up |

mod change;
mod document;
mod elements;
mod error;
mod not_correctable;
mod recorded_scan;
mod rig_file;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

pub use error::CorrectionError;
pub use not_correctable::Unwritten;
pub use recorded_scan::correct_recorded_scan;
pub use rig_file::correct_rig_file;

/// The result of a correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrected {
    /// The written files; the file that refers to the others is last.
    pub files: Vec<PathBuf>,
    /// The corrected effects, one line each: parameters with standard errors.
    pub written: Vec<String>,
    /// The named effects that were not corrected.
    pub unwritten: Vec<Unwritten>,
}

/// Writes a new file.
fn write_new(path: &Path, contents: &[u8]) -> Result<(), CorrectionError> {
    OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(path)
        .and_then(|mut file| {
            file.write_all(contents)?;
            file.sync_all()
        })
        .map_err(CorrectionError::writing(path))
}
