//! A recorded scan: a folder with `scan.toml` and `samples.csv`.

use std::io;
use std::path::{Path, PathBuf};

use super::durable;
use super::inside::without_ways_out;
use super::planes::{Plane, planes};
use super::repeats::{Repeat, repeats};
use super::sample::RecordedSample;
use super::samples_csv::{SampleLimits, read_samples, write_samples};
use super::setup::{ScanSetup, UnwritableSetup};
use fieldgap_input::Fault;

/// A measured field: its set-up, and its samples in the order of acquisition.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedScan {
    /// The set-up.
    pub setup: ScanSetup,
    /// The samples.
    pub samples: Vec<RecordedSample>,
}

/// Why a recorded scan was not written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum RecordError {
    /// The set-up cannot be written as a `scan.toml`.
    #[error(transparent)]
    Setup(#[from] UnwritableSetup),
    /// The folder contains a scan.
    #[error("{} already contains a scan; choose another folder, or move that scan away", .0.display())]
    Occupied(PathBuf),
    /// The file system refused.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

impl RecordedScan {
    /// Reads the scan in a folder. Other files in the folder are ignored.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid key, value or row, or at a link that leads out of the folder.
    pub fn open(folder: &Path) -> Result<Self, Fault> {
        without_ways_out(folder)?;
        let setup = ScanSetup::read(&folder.join("scan.toml"))?;
        let (_, samples) = read_samples(&folder.join("samples.csv"), &SampleLimits::of(&setup))?;
        Ok(Self { setup, samples })
    }

    /// Writes the scan into a folder, which is created if necessary. `scan.toml` is written last: a folder that has it is complete.
    ///
    /// # Errors
    /// [`RecordError`] if the folder contains a scan or cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), RecordError> {
        let scan_toml = folder.join("scan.toml");
        if scan_toml.exists() {
            return Err(RecordError::Occupied(folder.to_owned()));
        }
        let refused = |path: &Path| {
            let path = path.to_owned();
            |source| RecordError::Write { path, source }
        };
        std::fs::create_dir_all(folder).map_err(refused(folder))?;
        let mut rows = Vec::new();
        let samples_csv = folder.join("samples.csv");
        write_samples(&mut rows, &self.samples, &SampleLimits::of(&self.setup))
            .and_then(|()| durable::replace(&samples_csv, &rows))
            .map_err(refused(&samples_csv))?;
        for (name, bytes) in self.setup.files()? {
            let path = folder.join(name);
            durable::replace(&path, &bytes).map_err(refused(&path))?;
        }
        Ok(())
    }

    /// The samples taken with the array driven, by focus and height. See [`planes`].
    pub fn planes(&self, tolerance_mm: f64) -> Vec<Plane<'_>> {
        planes(&self.samples, tolerance_mm)
    }

    /// The samples taken with the array silent: the noise floor.
    pub fn silent(&self) -> impl Iterator<Item = &RecordedSample> {
        self.samples.iter().filter(|sample| sample.focus.is_none())
    }

    /// The points that were measured more than once: their readings differ by noise and drift. See [`repeats`].
    pub fn repeats(&self, tolerance_mm: f64) -> Vec<Repeat<'_>> {
        repeats(&self.samples, tolerance_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_input::TomlSource;

    fn scan() -> RecordedScan {
        let text = "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
                    [array]\nfrequency_hz = 40000.0\nlayout = \"linear\"\ncount = 2\n\
                    element_diameter_mm = 10.5\nspacing_mm = 0.0\n\
                    [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nphases = \"all-zero\"\n";
        let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good");
        let at = |focus, x: f64| {
            RecordedSample::measured(0.1, focus, Vec3::new(x, -0.0355, 0.05), 0.3, None)
        };
        RecordedScan { setup, samples: vec![at(None, 0.0), at(Some(0), 0.0), at(Some(0), 0.1)] }
    }

    #[test]
    fn a_scan_reads_back_as_it_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let inside = folder.path().join("a/new/folder");
        scan().write(&inside).expect("written");
        assert_eq!(RecordedScan::open(&inside).expect("good"), scan());
        assert_eq!(scan().silent().count(), 1);
    }

    #[test]
    fn a_scan_is_not_written_over_another() {
        let folder = tempfile::tempdir().expect("a folder");
        scan().write(folder.path()).expect("written");
        let again = scan().write(folder.path());
        assert!(matches!(again, Err(RecordError::Occupied(path)) if path == folder.path()));
    }

    #[test]
    fn a_folder_without_a_scan_is_a_fault_that_names_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let fault = RecordedScan::open(folder.path()).expect_err("empty");
        assert_eq!(fault.path(), folder.path().join("scan.toml"));
        scan().write(folder.path()).expect("written");
        std::fs::remove_file(folder.path().join("samples.csv")).expect("removed");
        let fault = RecordedScan::open(folder.path()).expect_err("no samples");
        assert_eq!(fault.path(), folder.path().join("samples.csv"));
    }

    #[test]
    fn a_focus_that_scan_toml_does_not_have_is_a_fault_in_samples_csv() {
        let folder = tempfile::tempdir().expect("a folder");
        scan().write(folder.path()).expect("written");
        let path = folder.path().join("samples.csv");
        let text = std::fs::read_to_string(&path).expect("there").replace("0.1,0,", "0.1,1,");
        std::fs::write(&path, text).expect("written");
        let fault = RecordedScan::open(folder.path()).expect_err("no such focus");
        assert_eq!((fault.path(), fault.line_column()), (path.as_path(), Some((3, 5))));
    }
}
