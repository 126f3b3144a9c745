//! `state.toml`: the state of a scan.

use std::fmt;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::durable;
use fieldgap_input::{Fault, toml_file};

/// The state of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScanState {
    /// It is running; or, if no process has locked its folder, it was killed.
    Scanning,
    /// It ended before its last point.
    Partial {
        /// The reason.
        reason: String,
    },
    /// Every point was measured.
    Complete,
}

impl fmt::Display for ScanState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scanning => f.write_str("was killed, or is still running"),
            Self::Partial { reason } => write!(f, "ended before its last point ({reason})"),
            Self::Complete => f.write_str("is complete"),
        }
    }
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StateFile {
    state: StateName,
    reason: Option<String>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum StateName {
    Scanning,
    Partial,
    Complete,
}

pub(super) const FILE: &str = "state.toml";

impl ScanState {
    /// The state of the scan in a folder; `None` if there is no `state.toml`, as with a scan recorded by other programs.
    ///
    /// # Errors
    /// A [`Fault`] if `state.toml` exists but cannot be read.
    pub fn of(folder: &Path) -> Result<Option<Self>, Fault> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let file: StateFile = toml_file(&path)?;
        Ok(Some(match file.state {
            StateName::Scanning => Self::Scanning,
            StateName::Partial => Self::Partial { reason: file.reason.unwrap_or_default() },
            StateName::Complete => Self::Complete,
        }))
    }

    /// Replaces `state.toml`.
    pub(super) fn write(&self, folder: &Path) -> io::Result<()> {
        let (state, reason) = match self {
            Self::Scanning => (StateName::Scanning, None),
            Self::Partial { reason } => (StateName::Partial, Some(reason.clone())),
            Self::Complete => (StateName::Complete, None),
        };
        let text = toml::to_string(&StateFile { state, reason }).map_err(io::Error::other)?;
        durable::replace(&folder.join(FILE), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_reads_back_as_it_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(ScanState::of(folder.path()).expect("readable"), None);
        let partial = ScanState::Partial { reason: "the robot's port \"x\"\nwent away".to_owned() };
        for state in [ScanState::Scanning, partial, ScanState::Complete] {
            state.write(folder.path()).expect("written");
            assert_eq!(ScanState::of(folder.path()).expect("readable"), Some(state));
        }
    }
}
