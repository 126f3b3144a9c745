//! A correction before it is written.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::changed_key::ChangedKey;
use super::error::CorrectionError;
use super::not_correctable::Unwritten;

/// A corrected set-up that is not yet written.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedCorrection {
    /// The keys of the set-up file that change.
    pub changes: Vec<ChangedKey>,
    /// The corrected effects, one line each: parameters with standard errors.
    pub written: Vec<String>,
    /// The named effects that are not corrected.
    pub unwritten: Vec<Unwritten>,
    /// A new folder, and the readings that are copied into it.
    pub(super) folder: Option<NewFolder>,
    /// The files in the order in which they are written; the last refers to the others.
    pub(super) files: Vec<(PathBuf, Vec<u8>)>,
}

/// The folder of a corrected scan.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NewFolder {
    pub(super) path: PathBuf,
    /// The `samples.csv` that is copied, and where to.
    pub(super) samples: Option<[PathBuf; 2]>,
}

/// The result of a correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrected {
    /// The written files; the file that refers to the others is last.
    pub files: Vec<PathBuf>,
    /// The keys of the set-up file that changed.
    pub changes: Vec<ChangedKey>,
    /// The corrected effects, one line each: parameters with standard errors.
    pub written: Vec<String>,
    /// The named effects that were not corrected.
    pub unwritten: Vec<Unwritten>,
}

impl PlannedCorrection {
    /// The same without a copy of the readings.
    pub fn without_readings(mut self) -> Self {
        if let Some(folder) = &mut self.folder {
            folder.samples = None;
        }
        self
    }

    /// Writes the corrected set-up.
    ///
    /// # Errors
    /// [`CorrectionError`] if a file or the folder exists already, or cannot be written.
    pub fn write(self) -> Result<Corrected, CorrectionError> {
        let mut written = Vec::new();
        if let Some(NewFolder { path, samples }) = self.folder {
            fs::create_dir(&path).map_err(CorrectionError::writing(&path))?;
            if let Some([from, to]) = samples {
                fs::copy(&from, &to).map_err(CorrectionError::writing(&to))?;
                written.push(to);
            }
        }
        for (path, contents) in self.files {
            write_new(&path, &contents)?;
            written.push(path);
        }
        Ok(Corrected {
            files: written,
            changes: self.changes,
            written: self.written,
            unwritten: self.unwritten,
        })
    }
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
