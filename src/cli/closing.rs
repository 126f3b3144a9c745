//! What `run` does beyond its report where the plan says `diagnose = true`: the cause named, the set-up corrected by it, and
//! the same readings compared with the simulation of the corrected set-up.

use std::path::Path;

use miette::{Diagnostic, IntoDiagnostic};

use super::compare::ComparisonArgs;
use super::diagnose::{tell, write_page};
use super::replay::write_report;
use crate::cli::output::say;
use fieldgap_comparison::GapReduction;
use fieldgap_correction::{CorrectionError, correct_recorded_scan};
use fieldgap_diagnosis::{PlaneShare, diagnose};
use fieldgap_records::{RecordedScan, SAME_HEIGHT_MM};
use fieldgap_report::ReportError;

/// The page that says why, in the report's folder.
const WHY: &str = "why";
/// The scan with the corrected set-up, in the scan's folder.
const CORRECTED: &str = "corrected";
/// The table of gaps, beside the corrected set-up.
const GAPS: &str = "gaps.txt";

/// Diagnoses the scan in `folder`, whose report stands in `report_folder`, against the simulator that it was made for; writes
/// page and corrected set-up; says on standard error what was found, what was corrected, and how the gap went.
///
/// A cause that cannot be corrected for is no error: it is said, and nothing is written but the page.
pub(super) fn close_gap(
    folder: &Path,
    comparison: &ComparisonArgs,
    report_folder: &Path,
) -> miette::Result<()> {
    let scans = [RecordedScan::open(folder)?];
    let [scan] = &scans;
    let diagnosis = diagnose(&scans, None).into_diagnostic()?;
    let page = write_page(&report_folder.join(WHY), &[folder.to_owned()], &scans, &diagnosis)?;
    say(format!("\n{}\nwhy: {}", diagnosis.sentence.replace('\u{a0}', " "), page.display()));

    let out = folder.join(CORRECTED);
    let corrected = match correct_recorded_scan(&diagnosis, &scan.setup, folder, &out) {
        Ok(corrected) => corrected,
        Err(
            nothing @ (CorrectionError::NothingNamed(_)
            | CorrectionError::NoKey { .. }
            | CorrectionError::NoSuchElement { .. }),
        ) => {
            say(format!("not corrected: {nothing}"));
            if let Some(help) = nothing.help() {
                say(format!("  {help}"));
            }
            return Ok(());
        }
        Err(error) => return Err(error.into()),
    };
    tell(&corrected);
    let again = RecordedScan::open(&out)?;
    let before = comparison.compare_with(scan, scan.setup.simulator)?;
    let after = [comparison.compare_with(&again, again.setup.simulator)?];
    let files = write_report(&out, &again, &after, &out.join("report"))?;
    say(format!("report of the corrected set-up: {}", files.index.display()));
    let noise_at = |focus: usize, z_mm: f64| {
        let mut planes = diagnosis.r#where.planes.iter();
        let same = |plane: &&PlaneShare| {
            plane.focus == focus && (plane.z_mm - z_mm).abs() < SAME_HEIGHT_MM
        };
        planes.find(same).map(|plane| plane.noise)
    };
    let gaps = GapReduction::between(scan, &before, &after[0])
        .with_noise(diagnosis.noise_floor, noise_at)
        .to_text();
    let path = out.join(GAPS);
    std::fs::write(&path, &gaps)
        .map_err(|source| ReportError::Write { path, source })
        .into_diagnostic()?;
    say(format!("\n{gaps}"));
    Ok(())
}
