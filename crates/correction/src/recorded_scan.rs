//! A recorded scan whose set-up is corrected as it was when the scan was made.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use super::change::{Change, Correction, corrections};
use super::document::{Document, head, numbers, set, to};
use super::elements::{changed, difference, is_of_elements};
use super::not_correctable::Unwritten;
use super::{Corrected, CorrectionError, write_new};
use fieldgap_acoustics::{Simulator, delays_s};
use fieldgap_diagnosis::Diagnosis;
use fieldgap_input::TomlSource;
use fieldgap_records::{FocusSection, Layout, ScanSetup, TRANSDUCER_BESIDE, write_elements};

/// Where the elements of a corrected scan stand.
const ELEMENTS: &str = "elements.csv";

/// Writes the recorded scan in `folder` into the new folder `out`: the same readings, and a set-up in which the cause that
/// the diagnosis names is believed, so that comparing it again shows what is left. `scanned` is the set-up of the scan that was
/// diagnosed.
///
/// Where the cause would change what the array is told, the drives are kept as the phases that it had been told.
///
/// # Errors
/// [`CorrectionError`] if the diagnosis names no cause, if nothing of it has a key in a `scan.toml`, if the array is not the
/// one that was diagnosed, or if the folder is there already.
pub fn correct_recorded_scan(
    diagnosis: &Diagnosis,
    scanned: &ScanSetup,
    folder: &Path,
    out: &Path,
) -> Result<Corrected, CorrectionError> {
    let (corrections, mut unwritten) = corrections(diagnosis)?;
    let source = TomlSource::read(&folder.join("scan.toml"))?;
    let setup = ScanSetup::parse(&source)?;
    if let Some(what) = difference(setup.array.array(), scanned.array.array()) {
        return Err(CorrectionError::OtherArray { path: folder.to_owned(), what });
    }
    let mends_simulator =
        corrections.iter().any(|correction| correction.change == Change::SimulatorModel);
    let frozen = setup.simulator == Simulator::AsWritten
        && !mends_simulator
        && setup.foci.iter().any(|focus| matches!(focus, FocusSection::Point(_)));
    let written: Vec<&Correction> = corrections
        .iter()
        .filter(|correction| {
            let lost = frozen && changes_drives(&correction.change);
            if lost {
                let why = "the drives would have to be kept as phases, and as-written freezes its path lengths at a focus \
                           that is given as a point";
                unwritten.push(Unwritten::new(correction.effect, why));
            }
            !lost
        })
        .collect();
    if written.is_empty() {
        return Err(CorrectionError::NoHome { path: folder.to_owned(), unwritten });
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
        document.name_elements(ELEMENTS, &notes.join(", "));
    }

    let probability = diagnosis.best().map_or(f64::NAN, |best| best.probability);
    let head = head(source.path(), &diagnosis.scans, probability, &written, &unwritten);
    fs::create_dir(out).map_err(CorrectionError::writing(out))?;
    let mut files = vec![out.join("samples.csv")];
    fs::copy(folder.join("samples.csv"), &files[0]).map_err(CorrectionError::writing(&files[0]))?;
    if by_file {
        let path = out.join(ELEMENTS);
        let mut bytes = Vec::new();
        write_elements(&mut bytes, &elements).map_err(CorrectionError::writing(&path))?;
        write_new(&path, &bytes)?;
        files.push(path);
    }
    if let Some(transducer) = setup.array.transducer_file() {
        let path = out.join(TRANSDUCER_BESIDE);
        write_new(&path, transducer.text().as_bytes())?;
        set(document.section("array"), "transducer", TRANSDUCER_BESIDE.into(), "");
        files.push(path);
    }
    // Last: a folder that has it, has all.
    let path = out.join("scan.toml");
    write_new(&path, document.text(&head).as_bytes())?;
    files.push(path);
    let written = written.iter().map(|correction| correction.found.clone()).collect();
    Ok(Corrected { files, written, unwritten })
}

/// Whether a focus, worked out from the corrected set-up, would be told otherwise than it had been.
fn changes_drives(change: &Change) -> bool {
    match change {
        Change::SpeedOfSound(_)
        | Change::Frequency(_)
        | Change::Pitch(_)
        | Change::Swapped(_)
        | Change::Tilt(_)
        | Change::Offset(_)
        | Change::Turn(_)
        | Change::Steps(_) => true,
        Change::Silent(_)
        | Change::Reversed(_)
        | Change::Amplitudes(_)
        | Change::Phases(_)
        | Change::Faces(_)
        | Change::SimulatorModel => false,
    }
}

/// Has every drive say the phases that the array emitted: the delays that it was told, at the frequency that it truly had, in
/// the steps that it truly made.
fn keep_drives(document: &mut Document, setup: &ScanSetup, written: &[&Correction]) {
    let mut frequency_hz = setup.array.frequency_hz();
    let mut steps = None;
    for correction in written {
        match correction.change {
            Change::Frequency(ratio) => frequency_hz *= ratio,
            Change::Steps(count) => steps = Some(count),
            _ => {}
        }
    }
    let believed = setup.medium.medium();
    for (focus, table) in setup.foci.iter().zip(document.foci()) {
        let array = setup.array.array();
        let told_s = delays_s(&focus.excitation(), array, &believed, setup.array.frequency_hz());
        let phases_rad = told_s.into_iter().map(|delay_s| {
            let periods = frequency_hz * delay_s;
            let periods = steps.map_or(periods, |steps| (periods * steps).round() / steps);
            to(TAU * periods, 1e-9)
        });
        for key in ["x_mm", "y_mm", "z_mm", "phases"] {
            table.remove(key);
        }
        let note = format!("what the array had been told for {focus}");
        set(table, "phases_rad", numbers(phases_rad), &note);
    }
}
