//! Results in the folders of the records: `reanalyses/NAME`.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use fieldgap_jobs::Batch;
use fieldgap_records::{without_ways_out, write_whole};
use serde::Serialize;

use crate::error::ReanalysisError;
use crate::name::ReanalysisName;
use crate::reanalysed::Reanalysed;
use crate::record_item::{INPUTS, RecordItem};
use crate::with::With;
use crate::work::Reanalysis;

/// The folder of reanalyses in that of a record.
pub const FOLDER: &str = "reanalyses";

/// What is written, and where.
#[derive(Debug, Clone, Copy)]
pub struct Keep<'k> {
    /// The reanalysis.
    pub reanalysis: &'k Reanalysis,
    /// Its batch.
    pub batch: &'k Batch,
    /// Its name.
    pub name: &'k ReanalysisName,
}

/// Contents of `provenance.json`: what the results are from.
#[derive(Debug, Serialize)]
struct Provenance<'p> {
    format: u32,
    name: &'p ReanalysisName,
    software: &'p str,
    made: &'p str,
    with: &'p With,
    /// SHA-256 of the files that the results depend on.
    sha256: BTreeMap<&'static str, Option<&'p str>>,
    batch_digest: &'p str,
}

impl Keep<'_> {
    /// Writes the result of a record into it; gives the folder. `provenance.json` comes last: a folder that has it is complete.
    ///
    /// # Errors
    /// [`ReanalysisError::Write`].
    pub fn keep(&self, item: &RecordItem, result: &Reanalysed) -> Result<PathBuf, ReanalysisError> {
        let record = self.reanalysis.folder().join(&item.record);
        // A link in the record must not lead the results elsewhere.
        without_ways_out(&record).map_err(|fault| ReanalysisError::Write {
            path: record.clone(),
            source: std::io::Error::other(fault.to_string()),
        })?;
        let folder = record.join(FOLDER).join(self.name.to_string());
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| ReanalysisError::Write { path, source }
        };
        fs::create_dir_all(&folder).map_err(failed(&folder))?;
        result.figures.write(&folder).map_err(failed(&folder))?;
        if let Some(diagnosis) = &result.diagnosis {
            put(&folder.join("diagnosis.json"), diagnosis.get())?;
        }
        let [samples, scan] = INPUTS;
        let provenance = Provenance {
            format: 1,
            name: self.name,
            software: self.batch.software(),
            made: self.batch.made(),
            with: self.reanalysis.with(),
            sha256: BTreeMap::from([
                (samples, item.samples_sha256.as_deref()),
                (scan, item.scan_sha256.as_deref()),
            ]),
            batch_digest: self.batch.digest(),
        };
        let text = serde_json::to_string_pretty(&provenance).expect("texts have JSON");
        put(&folder.join("provenance.json"), &text)?;
        Ok(folder)
    }
}

fn put(path: &Path, text: &str) -> Result<(), ReanalysisError> {
    write_whole(path, |file| writeln!(file, "{text}"))
        .map_err(|source| ReanalysisError::Write { path: path.to_owned(), source })
}
