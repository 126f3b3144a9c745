//! The records below a folder, each with the digests of the files that its results depend on.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use fieldgap_input::{MOST_TABLE, read_bytes};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::ReanalysisError;

/// The files of a record that its results depend on.
pub(crate) const INPUTS: [&str; 2] = ["samples.csv", "scan.toml"];

/// A record to be analysed again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordItem {
    /// Its folder, relative to that of the reanalysis; empty for that folder itself.
    pub record: PathBuf,
    /// SHA-256 of `samples.csv`, in hexadecimal digits; `None` if it could not be read.
    pub samples_sha256: Option<String>,
    /// SHA-256 of `scan.toml`.
    pub scan_sha256: Option<String>,
}

impl RecordItem {
    /// The item of a record.
    pub fn of(folder: &Path, record: PathBuf) -> Self {
        let [samples_sha256, scan_sha256] =
            INPUTS.map(|name| digest(&folder.join(&record).join(name)).ok());
        Self { record, samples_sha256, scan_sha256 }
    }

    /// The name of the record in tables.
    pub fn name(&self) -> String {
        match self.record.as_os_str().is_empty() {
            true => ".".to_owned(),
            false => self.record.display().to_string(),
        }
    }
}

fn digest(path: &Path) -> io::Result<String> {
    let bytes = read_bytes(path, MOST_TABLE)?;
    Ok(Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The records in a folder and below it, by their paths. A record within a record, such as its corrected set-up, has the same readings and is
/// left out; links to folders are not followed, because they may lead in circles.
pub(crate) fn records_below(folder: &Path) -> Result<Vec<RecordItem>, ReanalysisError> {
    let mut records = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(current) = folders.pop() {
        let path = folder.join(&current);
        if path.join("scan.toml").exists() {
            records.push(current);
            continue;
        }
        let failed = |source| ReanalysisError::Read { path: path.clone(), source };
        for entry in fs::read_dir(&path).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            if entry.file_type().map_err(failed)?.is_dir() {
                folders.push(current.join(entry.file_name()));
            }
        }
    }
    if records.is_empty() {
        return Err(ReanalysisError::NoRecords(folder.to_owned()));
    }
    records.sort_unstable();
    Ok(records.into_iter().map(|record| RecordItem::of(folder, record)).collect())
}
