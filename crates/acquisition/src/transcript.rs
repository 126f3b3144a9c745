//! A transcript of a rig check: what the devices were sent and what they answered, to be replayed elsewhere.

use std::fs;
use std::path::Path;

use super::AcquisitionError;
use super::open::WIRE_LOGS;
use super::origin::RIG_COPY;
use super::rig_setup::RigSetup;
use fieldgap_input::Fault;
use fieldgap_rig::Ports;
use fieldgap_rig::check::{CheckReport, check};
use fieldgap_rig::link::WireLogs;

/// The result of the check, in the folder of a transcript.
const RESULT: &str = "check.json";

/// Checks the devices of a rig, and writes the rig file, the traffic and the result to a new folder. [`replay_wire`](super::replay_wire)
/// runs the drivers against it. The folder holds no more than these: no names of people or of the computer.
///
/// # Errors
/// [`AcquisitionError::File`] if the folder exists or cannot be written. A device that fails is in the report.
pub async fn check_with_transcript(
    rig_setup: &RigSetup,
    ports: &Ports,
    folder: &Path,
) -> Result<CheckReport, AcquisitionError> {
    let unwritten = |path: &Path| {
        let path = path.to_owned();
        move |error: std::io::Error| {
            let problem = format!("the transcript cannot be written: {error}");
            Fault::of_file(&path, problem, "give a new folder on a disk with room")
        }
    };
    fs::create_dir(folder).map_err(unwritten(folder))?;
    let (copy, wire) = (folder.join(RIG_COPY), folder.join(WIRE_LOGS));
    fs::write(&copy, rig_setup.source().text()).map_err(unwritten(&copy))?;
    let logs = WireLogs::default();
    logs.keep_in(&wire).map_err(unwritten(&wire))?;
    let elements = rig_setup.nominal_array().len();
    let report = logs.around(check(&rig_setup.rig, ports, elements, Some(&logs))).await;
    let path = folder.join(RESULT);
    let json = serde_json::to_string_pretty(&report).expect("numbers and words are JSON");
    fs::write(&path, json).map_err(unwritten(&path))?;
    Ok(report)
}
