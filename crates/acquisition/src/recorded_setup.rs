//! The set-up that a scan records in `scan.toml`, and whether a record still has it.

use std::path::{Path, PathBuf};

use jiff::Timestamp;
use toml::{Table, Value};

use super::AcquisitionError;
use super::difference::{Difference, differences};
use super::rig_setup::RigSetup;
use fieldgap_input::Fault;
use fieldgap_records::{JournalError, PhaseConvention, PhaseSection, Plan, ScanSetup};
use fieldgap_rig::receiver::ReceiverIdentity;

/// The file.
const FILE: &str = "scan.toml";

/// The set-up of a scan that was started at `recorded`, with a receiver that reads in `unit`, and gives phases that mean this.
pub(super) fn setup_of(
    plan: &Plan,
    rig_setup: &RigSetup,
    recorded: Timestamp,
    unit: String,
    phase: Option<PhaseSection>,
) -> ScanSetup {
    ScanSetup {
        name: plan.name.clone(),
        recorded,
        unit,
        array: rig_setup.array.clone(),
        medium: rig_setup.medium,
        receiver: rig_setup.receiver.clone(),
        phase,
        uncertainty: rig_setup.uncertainty,
        simulator: plan.simulator,
        foci: plan.foci.clone(),
    }
}

/// Checks that the `scan.toml` of a record is that of its plan and rig file. The elements of the array are compared elsewhere.
///
/// # Errors
/// [`AcquisitionError::OtherRecord`] with each key that differs.
pub(super) fn same_record(
    plan: &Plan,
    rig_setup: &RigSetup,
    folder: &Path,
) -> Result<(), AcquisitionError> {
    let path = folder.join(FILE);
    let is = ScanSetup::read(&path)?;
    let mut wanted = setup_of(plan, rig_setup, is.recorded, is.unit.clone(), is.phase);
    let measured = rig_setup.rig.environment.as_ref().is_some_and(|air| air.sound_speed);
    if measured {
        // The medium was measured at the start of the scan.
        wanted.medium = is.medium;
    }
    let mut found = differences(table_of(wanted.clone())?, table_of(is.clone())?, &[]);
    let text = |setup: &ScanSetup| {
        let file = setup.array.transducer_file();
        file.map(|file| Value::String(file.text().to_owned()))
    };
    if text(&wanted) != text(&is) && found.is_empty() {
        let key = "array.transducer".to_owned();
        found.push(Difference { key, then: text(&wanted), now: text(&is) });
    }
    refuse(path, found)
}

/// What the phases of a receiver mean, where it gives them: the drivers turn them into the convention of this program.
pub(super) fn phase_of(receiver: &ReceiverIdentity) -> Option<PhaseSection> {
    receiver.phase.then(|| PhaseSection::of_drive_sync(PhaseConvention::MinusIwt))
}

/// Checks that a receiver reads in the unit of a record, and with a phase if the record has phases.
///
/// # Errors
/// As [`same_record`].
pub(super) fn same_unit(
    setup: &ScanSetup,
    receiver: &ReceiverIdentity,
    folder: &Path,
) -> Result<(), AcquisitionError> {
    let value = |text: &str| Some(Value::String(text.to_owned()));
    let phase = |has_phase: bool| has_phase.then_some(Value::Boolean(true));
    let found = [
        ("reading", value(&receiver.unit), value(&setup.unit)),
        ("phase", phase(receiver.phase), phase(setup.phase.is_some())),
    ]
    .into_iter()
    .filter(|(_, then, now)| then != now)
    .map(|(key, then, now)| Difference { key: key.to_owned(), then, now })
    .collect();
    refuse(folder.join(FILE), found)
}

/// Checks that the sensitivity of a rig file is for a receiver that reads in `unit`.
///
/// # Errors
/// [`AcquisitionError::File`] at the rig file.
pub(super) fn known_unit(rig_setup: &RigSetup, unit: &str) -> Result<(), AcquisitionError> {
    let Some(Err(wrong)) = rig_setup.receiver.as_ref().map(|receiver| receiver.rms_pa_of(unit))
    else {
        return Ok(());
    };
    Err(Fault::of_file(
        rig_setup.source().path(),
        wrong.to_string(),
        "correct [receiver], or remove the sensitivity",
    )
    .into())
}

fn refuse(path: PathBuf, found: Vec<Difference>) -> Result<(), AcquisitionError> {
    if found.is_empty() {
        return Ok(());
    }
    let shown =
        |value: Option<Value>| value.map_or("missing".to_owned(), |value| value.to_string());
    let said = |Difference { key, then, now }| {
        format!("`{key}` is {} and should be {}", shown(now), shown(then))
    };
    Err(AcquisitionError::OtherRecord { path, differences: found.into_iter().map(said).collect() })
}

/// As it is written to the file.
fn table_of(setup: ScanSetup) -> Result<Table, AcquisitionError> {
    let beside = ScanSetup { array: setup.array.clone().with_file_beside(), ..setup };
    let text = beside.to_toml().map_err(JournalError::Setup)?;
    Ok(text.parse().expect("it was written as TOML"))
}
