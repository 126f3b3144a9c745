//! Comparison of a record that was never compared.

use std::io;
use std::path::{Path, PathBuf};

use fieldgap_comparison::{Incomparable, Registering, compare};
use fieldgap_input::Fault;
use fieldgap_records::{AirRow, RecordedScan};

use crate::air::AirFigures;
use crate::figures::{REPORT, RecordFigures};

/// Why a record was not compared.
#[derive(Debug, thiserror::Error)]
pub enum NotCompared {
    /// It cannot be read.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// There is nothing to compare.
    #[error(transparent)]
    Incomparable(#[from] Incomparable),
    /// The figures cannot be written.
    #[error("the figures cannot be written into {}: {source}", folder.display())]
    Write {
        /// The folder of the report.
        folder: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

/// Compares the record in a folder with its own simulator, as `fieldgap replay` does, and writes `figures.json` into its folder `report`,
/// without a page.
///
/// # Errors
/// [`NotCompared`].
pub fn compare_record(folder: &Path) -> Result<RecordFigures, NotCompared> {
    let scan = RecordedScan::open(folder)?;
    let comparison = compare(&scan, scan.setup.simulator, Registering::Auto)?;
    let air = AirFigures::of(&AirRow::all_of(folder));
    let figures = RecordFigures::of(&scan, &comparison, None, air);
    let report = folder.join(REPORT);
    std::fs::create_dir_all(&report)
        .and_then(|()| figures.write(&report))
        .map_err(|source| NotCompared::Write { folder: report, source })?;
    Ok(figures)
}
