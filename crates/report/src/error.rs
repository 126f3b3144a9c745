//! Why a report could not be written.

use std::path::{Path, PathBuf};

pub use super::picture::PictureError;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file or folder could not be written.
    #[error("cannot write {}: is the disk full, or is writing there not permitted?", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A picture could not be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The comparison could not be turned into JSON.
    #[error("writing the comparison as JSON failed")]
    Json(#[from] serde_json::Error),
    /// There is nothing to report.
    #[error("there is no comparison to report")]
    NothingCompared,
}

impl ReportError {
    pub(super) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}
