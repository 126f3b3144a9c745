//! `events.jsonl`: what happened during a scan beside the readings.

use std::io;
use std::path::Path;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// Something that happened during a scan: one line of JSON in `events.jsonl`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Event {
    /// When.
    pub at: Timestamp,
    /// What.
    pub kind: EventKind,
    /// How many visits had been made.
    pub visits_done: usize,
    /// The particulars, for a person.
    pub text: String,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The scan was begun.
    Started,
    /// A device said who it is.
    Identified,
    /// The robot was homed.
    Homed,
    /// Reference points were revisited, and what they read.
    ReferenceChecked,
    /// How far the readings of flown rows lag behind the robot, and how evenly the rows were flown.
    Flown,
    /// The scan was asked to wait.
    Paused,
    /// It went on.
    Continued,
    /// A person was wanted.
    Question,
    /// A device failed, lost or spoilt a reading, or was lost.
    DeviceFault,
    /// There was no room for a reading; the scan waited until there was.
    Waited,
    /// The scan was taken up again.
    Resumed,
    /// A line that was cut off by the end of an earlier run was taken out of `samples.csv`; the text is what stood
    /// of it.
    LineCut,
    /// The scan ended, complete or not.
    Ended,
}

/// What happened during the scan in a folder, in its order. A torn last line, which a killed scan leaves, is left out; a
/// folder without `events.jsonl`, as records from elsewhere are, has none.
///
/// # Errors
/// What the file system refused; or the first line that is no event.
pub fn read_events(folder: &Path) -> io::Result<Vec<Event>> {
    let text = match std::fs::read_to_string(folder.join(super::EVENTS)) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    text.split_inclusive('\n')
        .filter(|line| line.ends_with('\n'))
        .map(|line| serde_json::from_str(line).map_err(io::Error::from))
        .collect()
}
