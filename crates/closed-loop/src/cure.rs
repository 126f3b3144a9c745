//! The set-up corrected by the named cause, in files of the record: the fresh places are simulated with it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use fieldgap_correction::{
    ChangedKey, CorrectionError, PlannedCorrection, Unwritten, plan_recorded_scan, plan_rig_file,
};
use fieldgap_diagnosis::{Diagnosis, EffectId};
use fieldgap_input::Fault;
use fieldgap_records::ScanSetup;
use serde::{Deserialize, Serialize};

/// The set-up of the recorded scan, in the folder of a cure.
const SET_UP: &str = "scan.toml";

/// The rig file for future scans, beside it, where a rig file has a key for the cause.
const RIG: &str = "rig.toml";

/// What was corrected before fresh readings were taken, and where.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cure {
    /// Folder of the corrected set-up, in that of the record; `None` where no set-up file has a key for any of the named effects.
    pub folder: Option<String>,
    /// The corrected effects, one line each: parameters with standard errors.
    pub corrected: Vec<String>,
    /// The keys that were changed.
    pub changes: Vec<ChangedKey>,
    /// The named effects that no file holds: they are accounted for as they were fitted.
    pub accounted: Vec<Unwritten>,
}

/// A cure whose files are not yet written.
pub(crate) struct PlannedCure {
    pub cure: Cure,
    files: Vec<PlannedCorrection>,
}

impl PlannedCure {
    /// By a diagnosis, for the record in `folder` of a rig with this rig file, before this round.
    ///
    /// # Errors
    /// [`CorrectionError`] if the set-up of the record cannot be read.
    pub fn of(
        diagnosis: &Diagnosis,
        scanned: &ScanSetup,
        folder: &Path,
        rig: &Path,
        round: usize,
    ) -> Result<Self, CorrectionError> {
        let name = format!("corrected-round-{round}");
        let out = folder.join(&name);
        let planned = match plan_recorded_scan(diagnosis, scanned, folder, &out) {
            Ok(planned) => planned.without_readings(),
            Err(CorrectionError::NoKey { unwritten: accounted, .. }) => {
                let cure =
                    Cure { folder: None, corrected: Vec::new(), changes: Vec::new(), accounted };
                return Ok(Self { cure, files: Vec::new() });
            }
            Err(error) => return Err(error),
        };
        let cure = Cure {
            folder: Some(name),
            corrected: planned.written.clone(),
            changes: planned.changes.clone(),
            accounted: planned.unwritten.clone(),
        };
        // Fewer causes have a key in a rig file; the proof does not need it.
        let for_future = plan_rig_file(diagnosis, scanned, rig, &out.join(RIG)).ok();
        Ok(Self { cure, files: [planned].into_iter().chain(for_future).collect() })
    }

    /// Writes the files into the record in `folder`. What a decision that was cut short has left there is replaced.
    ///
    /// # Errors
    /// [`CorrectionError`] if a file cannot be written.
    pub fn write(self, folder: &Path) -> Result<(), CorrectionError> {
        if let Some(name) = &self.cure.folder {
            let out = folder.join(name);
            match fs::remove_dir_all(&out) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(CorrectionError::Write { path: out, source });
                }
                _ => {}
            }
        }
        self.files.into_iter().try_for_each(|planned| planned.write().map(|_| ()))
    }
}

impl Cure {
    /// The effects that no file holds.
    pub fn accounted(&self) -> Vec<EffectId> {
        self.accounted.iter().map(|unwritten| unwritten.effect).collect()
    }

    /// The corrected set-up in the record in `folder`, read from its files; `None` where there are none.
    ///
    /// # Errors
    /// A [`Fault`] if the files are not there, or are wrong.
    pub(crate) fn set_up(&self, folder: &Path) -> Result<Option<ScanSetup>, Fault> {
        let read = |name| ScanSetup::read(&folder.join(name).join(SET_UP));
        self.folder.as_ref().map(read).transpose()
    }

    /// Writes the record in `folder` with this set-up into the new folder `out`; gives the files.
    ///
    /// # Errors
    /// [`CorrectionError`] if `out` exists, or if a file cannot be read or written.
    pub fn write_record(&self, folder: &Path, out: &Path) -> Result<Vec<PathBuf>, CorrectionError> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            |source| CorrectionError::Write { path, source }
        };
        let Some(from) = self.folder.as_ref().map(|name| folder.join(name)) else {
            return Ok(Vec::new());
        };
        if out.exists() {
            return Err(CorrectionError::Exists(out.to_owned()));
        }
        fs::create_dir(out).map_err(failed(out))?;
        let mut files = vec![folder.join("samples.csv")];
        for entry in fs::read_dir(&from).map_err(failed(&from))? {
            files.push(entry.map_err(failed(&from))?.path());
        }
        // The set-up comes last, so that a folder with this file is complete.
        files.sort_by_key(|path| (path.ends_with(SET_UP), path.clone()));
        let mut written = Vec::new();
        for path in files {
            let to = out.join(path.file_name().unwrap_or_default());
            fs::copy(&path, &to).map_err(failed(&to))?;
            written.push(to);
        }
        Ok(written)
    }
}
