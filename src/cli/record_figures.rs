//! The figures of a record, written beside its page.

use std::path::Path;

use miette::{IntoDiagnostic, WrapErr};

use fieldgap_archive::{AirFigures, FIGURES, RecordFigures};
use fieldgap_comparison::Comparison;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_records::{AirRow, RecordedScan};

/// Writes the figures of the first comparison of the record in `folder`, with its diagnosis, into the folder of a report.
pub(super) fn keep_figures(
    folder: &Path,
    scan: &RecordedScan,
    comparisons: &[Comparison],
    diagnosis: Option<&Diagnosis>,
    report_folder: &Path,
) -> miette::Result<()> {
    let Some(comparison) = comparisons.first() else { return Ok(()) };
    let air = AirFigures::of(&AirRow::all_of(folder));
    RecordFigures::of(scan, comparison, diagnosis, air)
        .write(report_folder)
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be written", report_folder.join(FIGURES).display()))?;
    Ok(())
}
