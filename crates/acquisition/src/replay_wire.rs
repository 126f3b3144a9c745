//! The wire logs of a recorded scan, run again.

use std::io;
use std::path::Path;

use super::AcquisitionError;
use super::open::WIRE_LOGS;
use super::rig_setup::RigSetup;
use super::scan_run::RIG_COPY;
use fieldgap_input::{Fault, TomlSource};
use fieldgap_rig::Role;
use fieldgap_rig::link::read_wire_log;
use fieldgap_rig::replay::{Replayed, replay};

/// Runs the drivers of the scan in a folder against the logs of its wires: each is asked what it was asked then, hears what was
/// heard then, and is held against what was sent.
///
/// # Errors
/// [`AcquisitionError`] if the folder has no rig file or no logs, or if a log is none.
pub fn replay_wire(folder: &Path) -> Result<Vec<Replayed>, AcquisitionError> {
    let rig_setup = RigSetup::parse(TomlSource::read(&folder.join(RIG_COPY))?)?;
    let logs = folder.join(WIRE_LOGS);
    let unreadable = |error: io::Error| {
        let remedy = "give the folder of a scan; those of earlier versions have no logs";
        Fault::of_file(&logs, format!("cannot be read: {error}"), remedy)
    };
    // Its own time, which passes only as the log's does.
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
                let problem = format!("line {line} of the {role}'s log is no entry of a wire log");
                Fault::of_file(&logs, problem, "bring the file back from a copy").into()
            })
        })
        .collect()
}
