//! Replaying the wire logs of a recorded scan.

use std::io;
use std::path::Path;

use serde::Deserialize;

use super::AcquisitionError;
use super::open::WIRE_LOGS;
use super::origin::RIG_COPY;
use super::rig_setup::RigSetup;
use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{ArrayTable, without_ways_out};
use fieldgap_rig::Role;
use fieldgap_rig::link::read_wire_log;
use fieldgap_rig::replay::{Replayed, replay};

/// The section of a rig file that names files to read.
#[derive(Deserialize)]
struct ArrayOfRig {
    array: ArrayTable,
}

/// Runs the drivers again against the wire logs of a recorded scan. Each driver gets the same calls and the same replies as
/// then; what it sends is compared with what it sent then.
///
/// # Errors
/// [`AcquisitionError`] if the folder has no rig file or no logs, or if a log is damaged.
pub fn replay_wire(folder: &Path) -> Result<Vec<Replayed>, AcquisitionError> {
    without_ways_out(folder)?;
    let source = TomlSource::read(&folder.join(RIG_COPY))?;
    source.parse::<ArrayOfRig>()?.array.stays_in_record(&source)?;
    let rig_setup = RigSetup::parse(source)?;
    let logs = folder.join(WIRE_LOGS);
    let unreadable = |error: io::Error| {
        let remedy = "give the folder of a scan; scans of early versions have no wire logs";
        Fault::of_file(&logs, format!("cannot be read: {error}"), remedy)
    };
    // A runtime whose time follows the log.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .start_paused(true)
        .build()
        .map_err(unreadable)?;
    [Role::FocusArray, Role::Receiver, Role::Robot]
        .into_iter()
        .map(|role| {
            let text = read_wire_log(&logs, role).map_err(unreadable)?;
            runtime.block_on(replay(&rig_setup.rig, role, &text)).map_err(|line| {
                let problem = format!("line {line} of the {role}'s wire log is not valid, or beyond the 10,000,000 that are replayed");
                Fault::of_file(&logs, problem, "restore the file from a copy").into()
            })
        })
        .collect()
}
