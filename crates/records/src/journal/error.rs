//! Why a scan could not be kept.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::ScanState;
use crate::{UnwritableSample, UnwritableSetup};
use fieldgap_input::Fault;

/// Why a scan could not be begun, kept or taken up again.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum JournalError {
    /// The folder is taken.
    #[error("{} holds a scan already, which {state}; {}", folder.display(), go_on(state, folder))]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// How that scan stands.
        state: ScanState,
    },
    /// Another process scans into the folder.
    #[error("another fieldgap is scanning into {}; wait for it, or stop it with Ctrl-C", .0.display())]
    Busy(PathBuf),
    /// There is nothing to take up.
    #[error(
        "{} holds no scan that could be resumed: no scan.toml is in it; check the path, or begin anew with `fieldgap scan`",
        .0.display()
    )]
    NoScan(PathBuf),
    /// There is nothing left to do.
    #[error("the scan in {folder} is complete; look at it with `fieldgap replay {folder}`", folder = .0.display())]
    AlreadyComplete(PathBuf),
    /// What is in the folder cannot be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Fault(#[from] Box<Fault>),
    /// The set-up fits in no `scan.toml`.
    #[error(transparent)]
    Setup(#[from] UnwritableSetup),
    /// The sample would make the record unreadable.
    #[error(
        "the reading of visit {visit} cannot be kept: {reason}; the {visit} before it are safe"
    )]
    Sample {
        /// Number of the visit, from 0.
        visit: usize,
        /// What is wrong with it.
        reason: BadSample,
    },
    /// A sample did not reach the disk.
    #[error(
        "the reading of visit {kept} did not reach {}: {source}; the {kept} before it are safe. {}, then \
         `fieldgap resume {}`",
        folder.join("samples.csv").display(), mend(source), folder.display()
    )]
    Append {
        /// The folder.
        folder: PathBuf,
        /// How many samples are on disk.
        kept: usize,
        /// What was reported.
        source: io::Error,
    },
    /// Something else did not reach the disk.
    #[error("cannot write {}: {source}. {}", path.display(), mend(source))]
    Write {
        /// What was being written.
        path: PathBuf,
        /// What was reported.
        source: io::Error,
    },
}

impl JournalError {
    /// Whether there was no room: it can be tried again when there is.
    pub fn is_no_room(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let (Self::Append { source, .. } | Self::Write { source, .. }) = self else { return false };
        matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge)
    }
}

/// Why a sample does not go into this record.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BadSample {
    /// No `samples.csv` could hold it.
    #[error(transparent)]
    Unwritable(#[from] UnwritableSample),
    /// The scan has no such focus.
    #[error("focus {focus} was driven, and the scan has {foci}, numbered from 0")]
    NoSuchFocus {
        /// The number.
        focus: usize,
        /// How many there are.
        foci: usize,
    },
}

fn go_on(state: &ScanState, folder: &std::path::Path) -> impl fmt::Display {
    let folder = folder.display();
    match state {
        ScanState::Complete => format!(
            "look at it with `fieldgap replay {folder}`, or choose another folder with --out"
        ),
        ScanState::Scanning | ScanState::Partial { .. } => {
            format!(
                "finish it with `fieldgap resume {folder}`, or choose another folder with --out"
            )
        }
    }
}

fn mend(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "Free some space on that disk"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "Make that folder writable"
        }
        _ => "Check that disk",
    }
}
