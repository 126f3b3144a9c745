//! Files that people write: plans, rig files, truth files, transducer files, displays, studies.

use std::path::{Path, PathBuf};

use fieldgap::acoustics::transducer::Transducer;
use fieldgap::campaign::{Campaign, CampaignError};
use fieldgap::display::{DisplayFile, RadiatingArray, compose};
use fieldgap::input::{Fault, TomlSource, is_hidden};
use fieldgap::records::{CalibrationFile, Plan, TransducerFile};
use fieldgap::rig::ArrayIdentity;
use fieldgap::rig_file::RigFile;
use fieldgap::study::Study;
use fieldgap::virtual_rig::Truth;

/// A text as a file beside the rig files of the project, so that names of other files are found.
fn source(case: &[u8]) -> TomlSource {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../rigs/case.toml");
    TomlSource::new(&path, String::from_utf8_lossy(case))
}

/// Shows an error as the program does. A terminal obeys nothing in it.
///
/// # Panics
/// If it cannot be shown, or has hidden characters.
pub fn shown(fault: &Fault) {
    let mut text = String::new();
    let handler =
        miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut text, fault).expect("an error can be shown");
    let hidden = |c: char| is_hidden(c) && c != '\n' && c != '\t';
    assert!(!text.chars().any(hidden), "{text:?}");
}

/// Most points of a plan whose visits are listed.
const LISTED: usize = 10_000;

/// A plan and its visits.
pub fn plan(case: &[u8]) {
    match Plan::parse(source(case)) {
        Ok(plan) => {
            let points: usize = plan.regions.iter().map(|region| region.shape.points()).sum();
            let visits = if points <= LISTED { plan.visits() } else { Vec::new() };
            for visit in visits {
                assert!(visit.position_m.iter().all(|m| m.is_finite()));
            }
        }
        Err(fault) => shown(&fault),
    }
}

/// A rig file with its section `[virtual]`.
pub fn rig(case: &[u8]) {
    if let Err(fault) = RigFile::parse(source(case)) {
        shown(&fault);
    }
}

/// Most cells of a campaign whose scans are planned.
const PLANNED: usize = 40;

/// The file of a campaign, and the scans of its first cells.
pub fn campaign(case: &[u8]) {
    let shown_fault = |error: &CampaignError| {
        if let CampaignError::File(fault) = error {
            shown(fault);
        }
    };
    match Campaign::parse(source(case)) {
        Ok(campaign) => {
            for cell in campaign.cells(1, 1).take(PLANNED) {
                assert!(campaign.id_of(&cell).len() < 200);
                if let Err(error) = campaign.scan_of(&cell) {
                    shown_fault(&error);
                }
            }
        }
        Err(error) => shown_fault(&error),
    }
}

/// A truth file of a virtual rig.
pub fn truth(case: &[u8]) {
    if let Err(fault) = Truth::from_source(&source(case)).and_then(|truth| truth.check(36)) {
        shown(&fault);
    }
}

/// A transducer file, and its directivity.
pub fn transducer(case: &[u8]) {
    match TransducerFile::parse(&source(case)) {
        Ok(file) => {
            for theta_rad in [0.0, 0.3, 1.5, 3.1] {
                let pressure = file.transducer().directivity(theta_rad, 4.5e-3, 733.0);
                assert!(pressure.is_finite(), "{pressure} at {theta_rad} rad");
            }
        }
        Err(fault) => shown(&fault),
    }
}

/// A calibration file, and an array that it is applied to.
pub fn calibration(case: &[u8]) {
    match CalibrationFile::parse(&source(case)) {
        Ok(file) => {
            let count = file.channels().len();
            let array = fieldgap::acoustics::Array::linear(count, 0.01).expect("not empty");
            for compensated in [false, true] {
                let applied = file.applied_to(&array, compensated).expect("as many elements");
                assert_eq!(applied.len(), count);
            }
        }
        Err(fault) => shown(&fault),
    }
}

/// A display, composed for the array of the thesis.
pub fn display(case: &[u8]) {
    let display = match DisplayFile::parse(source(case)) {
        Ok(display) => display,
        Err(fault) => return shown(&fault),
    };
    let array = fieldgap::acoustics::Array::square(6, 6, 10.5e-3).expect("a layout");
    let radiating = RadiatingArray {
        array: &array,
        medium: fieldgap::acoustics::Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        transducer: &fieldgap::acoustics::transducer::Piston,
    };
    let controller = ArrayIdentity::of_thesis(36, 40e3);
    let _ = compose(&display, &radiating, &controller);
}

/// A study, without its computation.
pub fn study(case: &[u8]) {
    match Study::read(source(case)) {
        Ok(study) => assert!(study.points() < usize::MAX),
        Err(fault) => shown(&fault),
    }
}
