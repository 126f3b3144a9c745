//! Correction of a rig file for future scans.

use std::path::Path;

use super::CorrectionError;
use super::change::{Change, Correction, corrections};
use super::document::{Document, head, numbers, round_to, set};
use super::elements::{changed, difference, is_of_elements};
use super::not_correctable::Unwritten;
use super::planned::{Corrected, PlannedCorrection};
use fieldgap_acquisition::RigSetup;
use fieldgap_diagnosis::Diagnosis;
use fieldgap_records::{Layout, ScanSetup, write_elements};
use fieldgap_rig::MotionConfig;

/// Writes a rig file `out` that includes the named cause, with a file of elements beside it if single elements changed.
/// `scanned` is the set-up of the diagnosed scan.
///
/// # Errors
/// [`CorrectionError`] if the diagnosis names no cause, if the cause has no key in a rig file, if the rig is not the scanned
/// one, or if a file exists already.
pub fn correct_rig_file(
    diagnosis: &Diagnosis,
    scanned: &ScanSetup,
    rig: &Path,
    out: &Path,
) -> Result<Corrected, CorrectionError> {
    if out.exists() {
        return Err(CorrectionError::Exists(out.to_owned()));
    }
    plan_rig_file(diagnosis, scanned, rig, out)?.write()
}

/// The correction of [`correct_rig_file`] without writing it.
///
/// # Errors
/// As there, but for an existing file.
pub fn plan_rig_file(
    diagnosis: &Diagnosis,
    scanned: &ScanSetup,
    rig: &Path,
    out: &Path,
) -> Result<PlannedCorrection, CorrectionError> {
    let (corrections, mut unwritten) = corrections(diagnosis)?;
    let rig_setup = RigSetup::read(rig)?;
    let other = |what| CorrectionError::OtherArray { path: rig.to_owned(), what };
    if let Some(what) = difference(rig_setup.nominal_array(), scanned.array.array()) {
        return Err(other(what));
    }
    if rig_setup.array.frequency_hz() != scanned.array.frequency_hz() {
        return Err(other("its frequency"));
    }
    let written: Vec<&Correction> = corrections
        .iter()
        .filter(|correction| match no_key(&correction.change, &rig_setup) {
            Some(why) => {
                unwritten.push(Unwritten::new(correction.effect, why));
                false
            }
            None => true,
        })
        .collect();
    if written.is_empty() {
        return Err(CorrectionError::NoKey { path: rig.to_owned(), unwritten });
    }

    let mut document = Document::parse(rig, rig_setup.source().text())?;
    let of_elements = written.iter().any(|correction| is_of_elements(&correction.change));
    let by_file = of_elements || matches!(rig_setup.array.layout(), Layout::Elements { .. });
    let mut elements = rig_setup.nominal_array().elements().to_vec();
    let mut notes = Vec::new();
    for correction in &written {
        document.correct_medium(correction, &rig_setup.medium);
        match &correction.change {
            Change::Offset(offset_mm) => {
                let origin_mm = rig_setup.rig.motion.frame().origin_m * 1e3 - offset_mm;
                correct_origin(&mut document, correction, &rig_setup.rig.motion, origin_mm.into());
            }
            Change::Pitch(_) if !by_file => document.correct_array(correction, &rig_setup.array),
            change => {
                document.correct_array(correction, &rig_setup.array);
                if is_of_elements(change) || matches!(change, Change::Pitch(_)) {
                    elements = changed(elements, change)?;
                    notes.push(correction.found.as_str());
                }
            }
        }
    }
    let rig_folder = rig.parent().unwrap_or(Path::new(""));
    if let Some(transducer) = rig_setup.array.transducer_path()
        && rig.parent() != out.parent()
    {
        let transducer = rig_folder.join(transducer);
        let transducer = std::path::absolute(&transducer).unwrap_or(transducer);
        let named = transducer.display().to_string();
        set(document.section("array"), "transducer", named.into(), "");
    }
    if let Some(truth) = rig_setup.truth_path()
        && rig.parent() != out.parent()
    {
        // The path was relative to the folder of the rig file.
        let truth = std::path::absolute(&truth).unwrap_or(truth);
        set(document.section("virtual"), "truth", truth.display().to_string().into(), "");
    }

    let mut files = Vec::new();
    let probability = diagnosis.best().map_or(f64::NAN, |best| best.probability);
    let head = head(rig, &diagnosis.scans, probability, &written, &unwritten);
    if by_file {
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        let name = format!("{stem}-elements.csv");
        document.name_elements(&name, &notes.join(", "));
        let path = out.with_file_name(name);
        let mut bytes = Vec::new();
        write_elements(&mut bytes, &elements).map_err(CorrectionError::writing(&path))?;
        files.push((path, bytes));
    }
    files.push((out.to_owned(), document.text(&head).into_bytes()));
    let written = written.iter().map(|correction| correction.found.clone()).collect();
    Ok(PlannedCorrection { changes: document.changes(), written, unwritten, folder: None, files })
}

/// Why a change has no key in a rig file; `None` if it has one.
fn no_key(change: &Change, rig_setup: &RigSetup) -> Option<&'static str> {
    let by_file = is_of_elements(change)
        || matches!(change, Change::Pitch(_))
            && matches!(rig_setup.array.layout(), Layout::Elements { .. });
    match change {
        // A file of elements beside it would apply the calibration twice, and its phases belong to the drive.
        _ if by_file && rig_setup.array.calibration_file().is_some() => Some(
            "the rig file names a calibration of its elements; measure it again with `fieldgap calibrate`",
        ),
        Change::SimulatorModel => Some(
            "a rig file has no simulator; set model = \"corrected\" in [simulator] of the plan, or use --simulator corrected",
        ),
        Change::Steps(..) => Some(
            "a rig file has no key for the steps of the driver; use a driver with more steps per period",
        ),
        _ => None,
    }
}

/// Sets the array's centre in the robot's axes, mm.
fn correct_origin(
    document: &mut Document,
    correction: &Correction,
    nominal: &MotionConfig,
    origin_mm: [f64; 3],
) {
    let [x, y, z] = nominal.origin_mm.map(|along| along.get());
    let note = format!("{}; [{x}, {y}, {z}] before", correction.found);
    let origin_mm = origin_mm.map(|along| round_to(along, 1e-3));
    set(document.section("motion"), "origin_mm", numbers(origin_mm), &note);
}
