//! Why a scan could not be recorded.

use std::fmt;
use std::io;
use std::path::PathBuf;

use super::ScanState;
use crate::{UnwritableSample, UnwritableSetup};
use fieldgap_input::Fault;

/// Why a scan could not be started, recorded or resumed.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum JournalError {
    /// The folder contains a scan.
    #[error("{} already contains a scan, which {state}; {}", folder.display(), next_step(state, folder))]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// The state of that scan.
        state: ScanState,
    },
    /// Another process scans into the folder.
    #[error("another fieldgap is scanning into {}; wait for it, or stop it with Ctrl-C", .0.display())]
    Busy(PathBuf),
    /// There is no scan to resume.
    #[error(
        "{} has no scan to resume: there is no scan.toml; check the path, or start a scan with `fieldgap scan`",
        .0.display()
    )]
    NoScan(PathBuf),
    /// The scan is complete.
    #[error("the scan in {folder} is complete; show it with `fieldgap replay {folder}`", folder = .0.display())]
    AlreadyComplete(PathBuf),
    /// A file of the folder cannot be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Fault(#[from] Box<Fault>),
    /// The set-up cannot be written as a `scan.toml`.
    #[error(transparent)]
    Setup(#[from] UnwritableSetup),
    /// The sample would make the record unreadable.
    #[error(
        "the reading of visit {visit} cannot be recorded: {reason}; the {visit} readings before it are safe"
    )]
    Sample {
        /// Number of the visit, from 0.
        visit: usize,
        /// The reason.
        reason: UnwritableSample,
    },
    /// A sample was not written.
    #[error(
        "the reading of visit {kept} could not be written to {}: {source}; the {kept} readings before it are safe. {}, then \
         `fieldgap resume {}`",
        folder.join("samples.csv").display(), remedy(source), folder.display()
    )]
    Append {
        /// The folder.
        folder: PathBuf,
        /// Number of samples on disk.
        kept: usize,
        /// The reason.
        source: io::Error,
    },
    /// The record is no longer in its folder.
    #[error(
        "the record was deleted, moved or replaced during the scan: {} is no longer the file that the scan writes; {kept} \
         readings were recorded in {}",
        file.display(), folder.display()
    )]
    #[diagnostic(help(
        "if the folder was moved, `fieldgap resume` with its new path completes the scan; a deleted record is lost"
    ))]
    Displaced {
        /// The folder.
        folder: PathBuf,
        /// The first file that is not there.
        file: PathBuf,
        /// Number of readings recorded before.
        kept: usize,
    },
    /// Another file was not written.
    #[error("cannot write {}: {source}. {}", path.display(), remedy(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

impl JournalError {
    /// Whether the disk was full: writing can be tried again when there is space.
    pub fn is_no_room(&self) -> bool {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let (Self::Append { source, .. } | Self::Write { source, .. }) = self else { return false };
        matches!(source.kind(), StorageFull | QuotaExceeded | FileTooLarge)
    }
}

fn next_step(state: &ScanState, folder: &std::path::Path) -> impl fmt::Display {
    let folder = folder.display();
    match state {
        ScanState::Complete => {
            format!("show it with `fieldgap replay {folder}`, or choose another folder with --out")
        }
        ScanState::Scanning | ScanState::Partial { .. } => {
            format!(
                "finish it with `fieldgap resume {folder}`, or choose another folder with --out"
            )
        }
    }
}

fn remedy(error: &io::Error) -> &'static str {
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
