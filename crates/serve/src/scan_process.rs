//! The process that runs a scan: found by the lock on its record, controlled by signals.
//!
//! A scan started from the command line is found in the same way, and so is one that outlived an earlier server.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use fieldgap_records::{Journal, ScanState};
use fieldgap_rig::link::holder_of;

/// Time between two looks at the state of a scan that was stopped.
const LOOK: Duration = Duration::from_millis(20);

/// How long a stopped scan may take to confirm that the rig is safe: the array half a second, the robot five.
const SAFE_WITHIN: Duration = Duration::from_secs(7);

/// The process that keeps the folder of a record locked, if it is a fieldgap.
pub(crate) fn process_of(folder: &Path, program: &Path) -> Option<Pid> {
    let holder = holder_of(&Journal::lock_file(folder).to_string_lossy())?;
    let named = program.file_name().is_some_and(|name| name.to_string_lossy() == holder.program);
    named.then(|| Pid::from_raw(holder.pid)).flatten()
}

/// The first record below `records` that a fieldgap process is writing.
pub(crate) fn running_below(records: &Path, program: &Path) -> Option<PathBuf> {
    let locks = fs::read_to_string("/proc/locks").ok()?;
    // Without a lock on the machine no folder needs to be looked at.
    if locks.is_empty() {
        return None;
    }
    let folders = fs::read_dir(records).ok()?.filter_map(Result::ok).map(|entry| entry.path());
    let mut scanned =
        folders.filter(|folder| matches!(ScanState::of(folder), Ok(Some(ScanState::Scanning))));
    scanned
        .find(|folder| folder.join("scan.toml").is_file() && process_of(folder, program).is_some())
}

/// What a person asks of the running scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ask {
    Pause,
    Continue,
    Stop,
}

/// Asks the process that runs the scan in `folder`; whether there is one.
pub(crate) fn ask(folder: &Path, program: &Path, ask: Ask) -> bool {
    let signal = match ask {
        Ask::Pause => Signal::USR1,
        Ask::Continue => Signal::USR2,
        Ask::Stop => Signal::TERM,
    };
    process_of(folder, program).is_some_and(|pid| kill_process(pid, signal).is_ok())
}

/// Stops the scan in `folder` and waits until its record says how the rig was left; that text.
pub(crate) async fn stop(folder: &Path, program: &Path) -> Option<String> {
    if !ask(folder, program, Ask::Stop) {
        return None;
    }
    let until = Instant::now() + SAFE_WITHIN;
    while Instant::now() < until {
        match ScanState::of(folder) {
            Ok(Some(ScanState::Partial { reason })) => return Some(reason),
            Ok(Some(ScanState::Complete)) => return Some("the scan was complete".to_owned()),
            _ => tokio::time::sleep(LOOK).await,
        }
    }
    Some(
        "THE SCAN HAS NOT CONFIRMED THAT THE RIG IS SAFE; SWITCH OFF THE POWER OF THE DEVICES"
            .to_owned(),
    )
}
