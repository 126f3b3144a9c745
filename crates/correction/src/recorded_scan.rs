//! Correction of the set-up of a recorded scan.

use std::f64::consts::TAU;
use std::path::Path;

use super::CorrectionError;
use super::change::{Change, Correction, corrections};
use super::document::{Document, head, numbers, round_to, set};
use super::elements::{changed, difference, is_of_elements};
use super::not_correctable::Unwritten;
use super::planned::{Corrected, NewFolder, PlannedCorrection};
use fieldgap_acoustics::{Simulator, delays_s};
use fieldgap_diagnosis::Diagnosis;
use fieldgap_input::TomlSource;
use fieldgap_records::{FocusSection, Layout, ScanSetup, TRANSDUCER_BESIDE, write_elements};

/// File of the elements of a corrected scan.
const ELEMENTS_FILE: &str = "elements.csv";

/// Writes the recorded scan in `folder` to the new folder `out`: the same readings, with a set-up that includes the named
/// cause, so that a comparison shows the residual. `scanned` is the set-up of the diagnosed scan.
///
/// If the cause would change the drives, they are kept as the phases that were emitted.
///
/// # Errors
/// [`CorrectionError`] if the diagnosis names no cause, if the cause has no key in a `scan.toml`, if the array is not the
/// diagnosed one, or if the folder exists already.
pub fn correct_recorded_scan(
    diagnosis: &Diagnosis,
    scanned: &ScanSetup,
    folder: &Path,
    out: &Path,
) -> Result<Corrected, CorrectionError> {
    plan_recorded_scan(diagnosis, scanned, folder, out)?.write()
}

/// The correction of [`correct_recorded_scan`] without writing it.
///
/// # Errors
/// As there, but for an existing folder.
pub fn plan_recorded_scan(
    diagnosis: &Diagnosis,
    scanned: &ScanSetup,
    folder: &Path,
    out: &Path,
) -> Result<PlannedCorrection, CorrectionError> {
    let (corrections, mut unwritten) = corrections(diagnosis)?;
    let source = TomlSource::read(&folder.join("scan.toml"))?;
    let setup = ScanSetup::parse(&source)?;
    if let Some(what) = difference(setup.array.array(), scanned.array.array()) {
        return Err(CorrectionError::OtherArray { path: folder.to_owned(), what });
    }
    let corrects_simulator =
        corrections.iter().any(|correction| correction.change == Change::SimulatorModel);
    let frozen = setup.simulator == Simulator::AsWritten
        && !corrects_simulator
        && setup.foci.iter().any(|focus| matches!(focus, FocusSection::Point(_)));
    let written: Vec<&Correction> = corrections
        .iter()
        .filter(|correction| {
            let lost = frozen && changes_drives(&correction.change);
            if lost {
                let why = "it would require drives as phases, and as-written freezes its path lengths at a focus given as a \
                           point";
                unwritten.push(Unwritten::new(correction.effect, why));
            }
            !lost
        })
        .collect();
    if written.is_empty() {
        return Err(CorrectionError::NoKey { path: folder.to_owned(), unwritten });
    }

    let mut document = Document::parse(source.path(), source.text())?;
    let of_elements =
        |change: &Change| is_of_elements(change) || matches!(change, Change::Offset(_));
    let by_file = written.iter().any(|correction| of_elements(&correction.change))
        || matches!(setup.array.layout(), Layout::Elements { .. });
    let mut elements = setup.array.array().elements().to_vec();
    let mut notes = Vec::new();
    if written.iter().any(|correction| changes_drives(&correction.change)) {
        keep_drives(&mut document, &setup, &written);
    }
    for correction in &written {
        document.correct_medium(correction, &setup.medium);
        if by_file
            && (of_elements(&correction.change) || matches!(correction.change, Change::Pitch(_)))
        {
            elements = changed(elements, &correction.change)?;
            notes.push(correction.found.as_str());
        } else {
            document.correct_array(correction, &setup.array);
        }
        if correction.change == Change::SimulatorModel {
            let note = format!("{}; {} before", correction.found, setup.simulator);
            let model = Simulator::Corrected.to_string();
            set(document.section("simulator"), "model", model.into(), &note);
        }
    }
    if by_file {
        document.name_elements(ELEMENTS_FILE, &notes.join(", "));
    }

    let probability = diagnosis.best().map_or(f64::NAN, |best| best.probability);
    let head = head(source.path(), &diagnosis.scans, probability, &written, &unwritten);
    let mut files = Vec::new();
    if by_file {
        let path = out.join(ELEMENTS_FILE);
        let mut bytes = Vec::new();
        write_elements(&mut bytes, &elements).map_err(CorrectionError::writing(&path))?;
        files.push((path, bytes));
    }
    if let Some(transducer) = setup.array.transducer_file() {
        let path = out.join(TRANSDUCER_BESIDE);
        set(document.section("array"), "transducer", TRANSDUCER_BESIDE.into(), "");
        files.push((path, transducer.text().as_bytes().to_vec()));
    }
    // Last, so that a folder with this file is complete.
    files.push((out.join("scan.toml"), document.text(&head).into_bytes()));
    let written = written.iter().map(|correction| correction.found.clone()).collect();
    let samples = [folder.join("samples.csv"), out.join("samples.csv")];
    let folder = Some(NewFolder { path: out.to_owned(), samples: Some(samples) });
    Ok(PlannedCorrection { changes: document.changes(), written, unwritten, folder, files })
}

/// Whether the drives of a focus would differ with the corrected set-up.
fn changes_drives(change: &Change) -> bool {
    match change {
        Change::SpeedOfSound(_)
        | Change::Frequency(..)
        | Change::Pitch(_)
        | Change::Swapped(_)
        | Change::Tilt(_)
        | Change::Offset(_)
        | Change::Turn(_)
        | Change::Steps(..) => true,
        Change::Silent(_)
        | Change::Reversed(_)
        | Change::Amplitudes(_)
        | Change::Phases(_)
        | Change::Faces(_)
        | Change::SimulatorModel => false,
    }
}

/// Writes every drive as the phases that the array emitted: the commanded delays in the steps of the driver, which are parts of the believed
/// period, at the corrected frequency.
fn keep_drives(document: &mut Document, setup: &ScanSetup, written: &[&Correction]) {
    let nominal_hz = setup.array.frequency_hz();
    let (mut ratio, mut within_a_period) = (1.0, false);
    let mut steps = None;
    for correction in written {
        match &correction.change {
            Change::Frequency(corrected, within) => {
                ratio *= corrected;
                within_a_period = *within;
            }
            Change::Steps(count, zeros) => steps = Some((*count, zeros)),
            _ => {}
        }
    }
    let nominal = setup.medium.medium();
    for (number, (focus, table)) in setup.foci.iter().zip(document.foci()).enumerate() {
        let array = setup.array.array();
        let commanded_s = delays_s(&focus.excitation(), array, &nominal, nominal_hz);
        let phases_rad = commanded_s.into_iter().map(|delay_s| {
            let mut periods = nominal_hz * delay_s;
            if within_a_period {
                periods -= (periods + 1e-9).floor();
            }
            let periods = steps.map_or(periods, |(count, zeros)| {
                let zero = zeros.get(number).or(zeros.first()).copied().unwrap_or(0.0);
                ((periods * count + zero).round() - zero) / count
            });
            round_to(TAU * ratio * periods, 1e-9)
        });
        for key in ["x_mm", "y_mm", "z_mm", "phases"] {
            table.remove(key);
        }
        let note = format!("phases emitted for {focus}");
        set(table, "phases_rad", numbers(phases_rad), &note);
    }
}
