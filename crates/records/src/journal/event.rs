//! `events.jsonl`: the events of a scan other than readings.

use std::io;
use std::path::Path;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use fieldgap_input::{MOST_TABLE, read_text};

/// An event of a scan: one line of JSON in `events.jsonl`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Event {
    /// Time.
    pub at: Timestamp,
    /// Kind.
    pub kind: EventKind,
    /// Number of visits before it.
    pub visits_done: usize,
    /// Details for a person.
    pub text: String,
}

/// The kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The scan was started.
    Started,
    /// A device identified itself.
    Identified,
    /// The robot was homed.
    Homed,
    /// Reference points were measured again; the text has their readings.
    ReferenceChecked,
    /// Rows were measured in motion; the text has the lag of the readings and how uniform the speed was.
    Flown,
    /// The readings of a round were chosen, or none.
    RoundChosen,
    /// The scan was paused.
    Paused,
    /// The scan was continued after a pause.
    Continued,
    /// The scan needed a decision by a person.
    Question,
    /// A device failed, lost or spoilt a reading, or was disconnected.
    DeviceFault,
    /// The disk was full; the scan waited for space.
    Waited,
    /// The computer was suspended; the text has for how long, and where the robot is.
    Suspended,
    /// The watchdog was lost, or started again.
    Watchdog,
    /// The scan was resumed.
    Resumed,
    /// A line that an earlier run left incomplete was removed from `journal.csv`; the text is what there was of it.
    LineCut,
    /// The scan ended, complete or not.
    Ended,
}

/// The events of the scan in a folder, in their order. An incomplete last line, which a killed scan leaves, is left out. A folder
/// without `events.jsonl`, such as an imported record, has none.
///
/// # Errors
/// An error of the file system, or the first line that is not an event.
pub fn read_events(folder: &Path) -> io::Result<Vec<Event>> {
    let text = match read_text(&folder.join(super::EVENTS), MOST_TABLE) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    text.split_inclusive('\n')
        .filter(|line| line.ends_with('\n'))
        .map(|line| serde_json::from_str(line).map_err(io::Error::from))
        .collect()
}
