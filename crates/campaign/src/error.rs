//! Why a campaign cannot run.

use std::io;
use std::path::PathBuf;

use fieldgap_acquisition::AcquisitionError;
use fieldgap_input::Fault;

/// Why a campaign cannot run.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum CampaignError {
    /// A file is wrong.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] Fault),
    /// A cell cannot be scanned.
    #[error("the cell `{cell}` cannot be scanned")]
    #[diagnostic(help(
        "correct the axis, the condition, the plan or the rig file that gives this cell"
    ))]
    Cell {
        /// The cell.
        cell: String,
        /// Why.
        #[source]
        source: Box<AcquisitionError>,
    },
    /// The folder has no campaign.
    #[error("{} holds no campaign", .0.display())]
    #[diagnostic(help("name the folder that `fieldgap campaign run` wrote"))]
    NoCampaign(PathBuf),
    /// The folder has one already.
    #[error("{} already holds a campaign", .0.display())]
    #[diagnostic(help(
        "continue it with `fieldgap campaign resume`, or choose another folder with --out"
    ))]
    Occupied(PathBuf),
    /// Another process runs it.
    #[error("another process runs the campaign in {}", .0.display())]
    #[diagnostic(help("wait until it has ended, or end it"))]
    Busy(PathBuf),
    /// A file of the campaign's folder cannot be read or written.
    #[error("cannot {what} {}: {source}", path.display())]
    #[diagnostic(help("check the disk and the permissions of the folder"))]
    Disk {
        /// `read` or `write`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

impl CampaignError {
    /// A cell that cannot be scanned. A fault of its plan or rig file names the cell and shows the line.
    pub(super) fn of_cell(cell: &str, source: AcquisitionError) -> Self {
        match source {
            AcquisitionError::File(fault) => Self::File(fault),
            source => Self::Cell { cell: cell.to_owned(), source: Box::new(source) },
        }
    }

    pub(super) fn writing(path: &std::path::Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Disk { what: "write", path, source }
    }
}
