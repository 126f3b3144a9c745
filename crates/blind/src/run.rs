//! Diagnoses every scan of a folder, without opening sealed answers.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::error::BlindError;
use super::parsed_diagnosis::ParsedDiagnosis;
use fieldgap_comparison::Incomparable;
use fieldgap_records::RecordedScan;

/// Scans to be diagnosed, and the folder for the diagnoses.
#[derive(Debug, Clone)]
pub struct Run {
    /// The folder that contains the folders of the scans.
    pub folder: PathBuf,
    /// The folder for the diagnoses, `NAME.json`.
    pub diagnoses: PathBuf,
    /// Names of the scans to diagnose; empty: all.
    pub only: Vec<String>,
}

/// One scan diagnosed.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosed {
    /// The scan's folder.
    pub name: String,
    /// Its diagnosis.
    pub diagnosis: ParsedDiagnosis,
    /// Duration, s; `None` where it was not measured.
    pub seconds: Option<f64>,
}

impl std::fmt::Display for Diagnosed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.4}"));
        let verdict = serde_json::to_value(self.diagnosis.verdict).unwrap_or_default();
        write!(
            f,
            "{}  {:<11}  {:<40}  gap {}  explained {}",
            self.name,
            verdict.as_str().unwrap_or_default(),
            self.diagnosis.named(),
            number(self.diagnosis.gap_before),
            number(self.diagnosis.explained_fraction),
        )?;
        self.seconds.map_or(Ok(()), |seconds| write!(f, "  {seconds:.1} s"))
    }
}

impl Run {
    /// The scans' names, in order.
    ///
    /// # Errors
    /// [`BlindError`] if the folder cannot be read, has no scans, or lacks a requested one.
    pub fn names(&self) -> Result<Vec<String>, BlindError> {
        let help = "name the folder that contains the folders of recorded scans";
        let failed = |error| BlindError::reading(&self.folder, help)(error);
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            if entry.path().join("scan.toml").exists() {
                names.push(entry.file_name().to_string_lossy().into_owned());
            }
        }
        names.sort_unstable();
        if names.is_empty() {
            return Err(BlindError::NoScans(self.folder.clone()));
        }
        if let Some(name) = self.only.iter().find(|name| !names.contains(name)) {
            let (folder, name) = (self.folder.clone(), name.clone());
            return Err(BlindError::UnknownScan { folder, name });
        }
        if !self.only.is_empty() {
            names.retain(|name| self.only.contains(name));
        }
        Ok(names)
    }

    /// Diagnoses these scans, several at a time, and writes each diagnosis at once. `done` is called after each. A scan that fails
    /// does not stop the others.
    ///
    /// Each scan has threads of its own, so that its duration does not depend on the others.
    pub fn each<D: Serialize + Send>(
        &self,
        names: &[String],
        diagnose: impl Fn(&[RecordedScan]) -> Result<D, Incomparable> + Sync,
        done: impl Fn(Result<Diagnosed, BlindError>) + Sync,
    ) {
        let threads = rayon::current_num_threads();
        let at_a_time = threads.min(names.len()).max(1);
        let next = AtomicUsize::new(0);
        let (next, diagnose, done) = (&next, &diagnose, &done);
        std::thread::scope(|scope| {
            for _ in 0..at_a_time {
                scope.spawn(move || {
                    let pool = ThreadPoolBuilder::new().num_threads(threads / at_a_time).build();
                    while let Some(name) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
                        done(match &pool {
                            Ok(pool) => self.one(name, &|scans| pool.install(|| diagnose(scans))),
                            // Without threads of its own it uses those of the program.
                            Err(_) => self.one(name, diagnose),
                        });
                    }
                });
            }
        });
    }

    fn one<D: Serialize>(
        &self,
        name: &str,
        diagnose: &impl Fn(&[RecordedScan]) -> Result<D, Incomparable>,
    ) -> Result<Diagnosed, BlindError> {
        let scan = RecordedScan::open(&self.folder.join(name))?;
        let begun = Instant::now();
        let diagnosis = diagnose(std::slice::from_ref(&scan))
            .map_err(|source| BlindError::Incomparable { name: name.to_owned(), source })?;
        let seconds = begun.elapsed().as_secs_f64();
        let bytes = serde_json::to_vec(&diagnosis).map_err(no_json(&self.diagnoses, name))?;
        Ok(Diagnosed { seconds: Some(seconds), ..self.keep(name, &bytes)? })
    }

    /// Those of these scans that have no diagnosis yet.
    pub fn not_diagnosed(&self, mut names: Vec<String>) -> Vec<String> {
        names.retain(|name| !diagnosis_of(&self.diagnoses, name).exists());
        names
    }

    /// Keeps the diagnosis of a scan that was made elsewhere, as JSON.
    ///
    /// # Errors
    /// [`BlindError`] if it is not a diagnosis or cannot be written.
    pub fn keep(&self, name: &str, json: &[u8]) -> Result<Diagnosed, BlindError> {
        let path = diagnosis_of(&self.diagnoses, name);
        std::fs::create_dir_all(&self.diagnoses).map_err(BlindError::writing(&self.diagnoses))?;
        std::fs::write(&path, json).map_err(BlindError::writing(&path))?;
        let diagnosis = serde_json::from_slice(json).map_err(no_json(&self.diagnoses, name))?;
        Ok(Diagnosed { name: name.to_owned(), diagnosis, seconds: None })
    }
}

fn no_json(diagnoses: &Path, name: &str) -> impl FnOnce(serde_json::Error) -> BlindError {
    let path = diagnosis_of(diagnoses, name);
    let help = "this is a bug of the program: its diagnosis is not JSON of format 1";
    move |source| BlindError::Json { path, source, help }
}

/// The path of a scan's diagnosis.
pub(super) fn diagnosis_of(diagnoses: &Path, name: &str) -> PathBuf {
    diagnoses.join(format!("{name}.json"))
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::super::assignment::Shares;
    use super::super::make::{SetToMake, Worlds};
    use super::*;

    #[test]
    fn every_scan_is_diagnosed_and_one_that_fails_does_not_stop_the_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let shares = Shares { none: 1.0, ..Shares::SINGLE };
        let set = SetToMake { count: 2, seed: 1, shares, worlds: Worlds::Bench };
        set.make(folder.path(), || ()).expect("made");
        std::fs::write(folder.path().join("answers.sealed"), "closed").expect("written");
        let diagnoses = folder.path().join("diagnoses");
        let mut run = Run { folder: folder.path().to_owned(), diagnoses, only: Vec::new() };
        assert_eq!(run.names().expect("two scans"), ["0000", "0001"]);
        let lines = Mutex::new(Vec::new());
        run.each(
            &run.names().expect("two scans"),
            |scans| match scans[0].setup.name.as_str() {
                "0000" => Ok(serde_json::json!({ "verdict": "none", "gap_before": 0.04 })),
                name => Err(Incomparable::AllZero(name.to_owned())),
            },
            |done| lines.lock().expect("no panic").push(done.map(|done| done.to_string())),
        );
        let lines = lines.into_inner().expect("no panic");
        assert_eq!(lines.iter().filter(|line| line.is_err()).count(), 1);
        let good = lines.iter().flatten().next().expect("one is diagnosed");
        assert!(good.starts_with("0000  none") && good.contains("gap 0.0400"), "{good}");
        assert!(ParsedDiagnosis::read(&diagnosis_of(&run.diagnoses, "0000")).is_ok());
        run.only = vec!["0007".to_owned()];
        assert!(matches!(run.names(), Err(BlindError::UnknownScan { .. })));
    }
}
