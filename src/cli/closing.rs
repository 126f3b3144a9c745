//! What `run` does after its scan: the comparison, the cause, the report that answers first, and, where the plan says
//! `diagnose = true`, the corrected set-up and the same readings compared with its simulation.

use std::path::Path;

use miette::{Diagnostic, IntoDiagnostic};

use super::compare::ComparisonArgs;
use super::diagnose::{tell, write_page};
use super::proposal::proposed_correction;
use super::record_figures::keep_figures;
use super::replay::{Report, show, write_report};
use super::rounds_page::write_rounds_page;
use crate::cli::output::say;
use fieldgap_closed_loop::{End, read_rounds, verified};
use fieldgap_comparison::{Comparison, GapReduction};
use fieldgap_correction::{Corrected, CorrectionError, correct_recorded_scan};
use fieldgap_diagnosis::{Diagnosis, PlaneShare, diagnose};
use fieldgap_records::{RecordedScan, SAME_HEIGHT_MM};
use fieldgap_report::{Cause, PrintStyle, ReportError, headline};

/// The page that says why, in the report's folder.
const WHY: &str = "why";
/// The scan with the corrected set-up, in the scan's folder.
const CORRECTED: &str = "corrected";
/// The table of gaps, beside the corrected set-up.
const GAPS: &str = "gaps.txt";

/// Fewest readings, and fewest heights, from which a cause is sought unasked. Fewer leave several causes that fit alike; the probabilities
/// of the diagnosis were calibrated on scans of thousands of readings at several heights.
const FEWEST_READINGS: usize = 500;
const FEWEST_HEIGHTS: usize = 2;

/// What is sought beside the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Closing {
    /// Nothing: the comparison alone.
    Comparison,
    /// The cause.
    Cause,
    /// The cause, and the gap after its correction.
    Correction,
}

/// Compares the scan in `folder`, seeks the cause, and writes the report; the comparisons.
pub(super) fn close(
    folder: &Path,
    args: &ComparisonArgs,
    report_folder: &Path,
    closing: Closing,
) -> miette::Result<Vec<Comparison>> {
    let scans = [RecordedScan::open(folder)?];
    let [scan] = &scans;
    let comparisons = args.compare(folder, scan)?;
    show(&comparisons, args);
    let diagnosis = sought(&scans, &comparisons, closing)?;
    let correction =
        diagnosis.as_ref().and_then(|diagnosis| proposed_correction(folder, scan, diagnosis));
    let cause =
        diagnosis.as_ref().map(|diagnosis| Cause { diagnosis, correction: correction.as_ref() });

    let mut pages = Vec::new();
    if let Some(diagnosis) = &diagnosis {
        pages.push(("Why they differ".to_owned(), format!("{WHY}/index.html")));
        let back = ("Scan and simulation".to_owned(), "../index.html".to_owned());
        let page = write_page(
            &report_folder.join(WHY),
            &[folder.to_owned()],
            &scans,
            diagnosis,
            vec![back],
        )?;
        keep_figures(folder, scan, &comparisons, Some(diagnosis), &report_folder.join(WHY))?;
        say(format!("\n{}\nwhy: {}", diagnosis.sentence.replace('\u{a0}', " "), page.display()));
    }
    pages.extend(write_rounds_page(folder, scan, report_folder)?);
    let corrected = match &diagnosis {
        Some(diagnosis) if closing == Closing::Correction => {
            close_gap(folder, scan, args, report_folder, diagnosis)?
        }
        _ => false,
    };
    if corrected {
        let address = relative(report_folder, &folder.join(CORRECTED).join("report/index.html"));
        pages.extend(address.map(|address| ("Corrected set-up".to_owned(), address)));
    }
    let pictures = PrintStyle::default();
    let report = Report { folder, scan, comparisons: &comparisons, cause, pages, pictures };
    let files = write_report(report, report_folder)?;
    keep_figures(folder, scan, &comparisons, diagnosis.as_ref(), report_folder)?;
    if let Some(first) = comparisons.first() {
        say(format!("\n{}", headline(first, diagnosis.as_ref()).replace('\u{a0}', " ")));
    }
    say(format!("report: {}", files.index.display()));
    Ok(comparisons)
}

/// The cause, where it is sought and the readings can show it.
fn sought(
    scans: &[RecordedScan; 1],
    comparisons: &[Comparison],
    closing: Closing,
) -> miette::Result<Option<Diagnosis>> {
    let [scan] = scans;
    if closing == Closing::Comparison {
        return Ok(None);
    }
    let simulator = comparisons.first().map(|comparison| comparison.simulator);
    if closing == Closing::Correction {
        return diagnose(scans, simulator).map(Some).into_diagnostic();
    }
    let readings = comparisons.first().map_or(0, |comparison| comparison.points);
    let heights = scan.planes(SAME_HEIGHT_MM).len();
    if readings < FEWEST_READINGS || heights < FEWEST_HEIGHTS {
        let heights =
            if heights == 1 { "one height".to_owned() } else { format!("{heights} heights") };
        say(format!(
            "\nnot diagnosed: {readings} readings at {heights} leave several causes possible; a cause is sought from \
             {FEWEST_READINGS} readings at {FEWEST_HEIGHTS} heights on, or by `fieldgap diagnose`"
        ));
        return Ok(None);
    }
    match diagnose(scans, simulator) {
        Ok(diagnosis) => Ok(Some(diagnosis)),
        // The comparison stands without a cause.
        Err(error) => {
            say(format!("\nnot diagnosed: {error}"));
            Ok(None)
        }
    }
}

/// Corrects the set-up by the named cause and compares the same readings with its simulation; says what was corrected, and how the gap
/// went. False, with the reason said, if the cause cannot be corrected.
fn close_gap(
    folder: &Path,
    scan: &RecordedScan,
    args: &ComparisonArgs,
    report_folder: &Path,
    diagnosis: &Diagnosis,
) -> miette::Result<bool> {
    let out = folder.join(CORRECTED);
    let corrected = match set_up_corrected(folder, scan, diagnosis, &out) {
        Ok(Some(corrected)) => corrected,
        Ok(None) => return Ok(false),
        Err(
            nothing @ (CorrectionError::NothingNamed(_)
            | CorrectionError::NoKey { .. }
            | CorrectionError::NoSuchElement { .. }),
        ) => {
            say(format!("not corrected: {nothing}"));
            if let Some(help) = nothing.help() {
                say(format!("  {help}"));
            }
            return Ok(false);
        }
        Err(error) => return Err(error.into()),
    };
    tell(&corrected);
    let again = RecordedScan::open(&out)?;
    let before = args.compare_with(scan, scan.setup.simulator)?;
    let after = [args.compare_with(&again, again.setup.simulator)?];
    let corrected_report = out.join("report");
    let back = relative(&corrected_report, &report_folder.join("index.html"));
    let pages = back.map(|address| ("Set-up as scanned".to_owned(), address)).into_iter().collect();
    let pictures = PrintStyle::default();
    let report =
        Report { folder: &out, scan: &again, comparisons: &after, cause: None, pages, pictures };
    let files = write_report(report, &corrected_report)?;
    keep_figures(&out, &again, &after, None, &corrected_report)?;
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
    Ok(true)
}

/// The corrected set-up: that of the cause that held on fresh readings where a closed loop tested one, otherwise that of the diagnosis.
/// `None`, with the reason said, if a loop that tests its causes ended without one that holds.
fn set_up_corrected(
    folder: &Path,
    scan: &RecordedScan,
    diagnosis: &Diagnosis,
    out: &Path,
) -> Result<Option<Corrected>, CorrectionError> {
    let rounds = read_rounds(folder).unwrap_or_default();
    match (rounds.last().and_then(|last| last.end), verified(&rounds)) {
        (None | Some(End::Explained), _) => {
            correct_recorded_scan(diagnosis, &scan.setup, folder, out).map(Some)
        }
        (_, Some(cure)) if cure.folder.is_some() => {
            let files = cure.write_record(folder, out)?;
            Ok(Some(Corrected {
                files,
                changes: cure.changes.clone(),
                written: cure.corrected.clone(),
                unwritten: cure.accounted.clone(),
            }))
        }
        (_, Some(cure)) => {
            let unwritten = cure.accounted.clone();
            Err(CorrectionError::NoKey { path: folder.to_owned(), unwritten })
        }
        (Some(_), None) => {
            say("not corrected: the loop ended without a cause that holds on fresh readings");
            Ok(None)
        }
    }
}

/// The address of a file relative to a folder, for a link; both lie below one folder.
fn relative(from: &Path, to: &Path) -> Option<String> {
    let (from, to) = (std::path::absolute(from).ok()?, std::path::absolute(to).ok()?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| "..".to_owned());
    let down =
        to.components().skip(shared).map(|part| part.as_os_str().to_string_lossy().into_owned());
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_leads_from_folder_to_file() {
        let address = |from: &str, to: &str| relative(Path::new(from), Path::new(to));
        assert_eq!(
            address("out/a/report", "out/a/corrected/report/index.html").as_deref(),
            Some("../corrected/report/index.html")
        );
        assert_eq!(address("out/a", "out/a/index.html").as_deref(), Some("index.html"));
    }
}
