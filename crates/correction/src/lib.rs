//! Set-up files corrected by what a diagnosis found, so that the next simulation includes it.
//!
//! A rig file is corrected for the scans to come: what the array is told follows from what is believed, so that with the right
//! belief it is told the right thing. A recorded scan is corrected as it was: what the array *had been* told stays, as phases,
//! and only what was true meanwhile changes. An effect that these files have no key for is named, with what to do instead.
//!
//! | file | what it does |
//! |---|---|
//! | `change` | from the named cause to what it changes in a set-up |
//! | `not_correctable` | the effects that change nothing there, and why |
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

/// What became of a correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrected {
    /// The files that were written, the one that names the others last.
    pub files: Vec<PathBuf>,
    /// What is in them now, one line an effect: its parameters with their standard errors.
    pub written: Vec<String>,
    /// The named effects that are not.
    pub unwritten: Vec<Unwritten>,
}

/// Writes a file that was not there before.
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
