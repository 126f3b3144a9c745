//! The folder that a report is written into.

use std::path::{Path, PathBuf};

use super::ReportError;
use super::figure::Figure;

/// A folder that exists.
pub(super) struct Folder<'d>(&'d Path);

impl<'d> Folder<'d> {
    /// Creates it if it is missing.
    pub fn make(dir: &'d Path) -> Result<Self, ReportError> {
        std::fs::create_dir_all(dir).map_err(ReportError::write(dir))?;
        Ok(Self(dir))
    }

    /// Writes a file; gives its path.
    pub fn put(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, ReportError> {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).map_err(ReportError::write(&path))?;
        Ok(path)
    }

    /// Writes figures, each in both forms.
    pub fn put_figures<'f>(
        &self,
        figures: impl Iterator<Item = &'f Figure>,
    ) -> Result<Vec<PathBuf>, ReportError> {
        let mut pictures = Vec::new();
        for figure in figures {
            pictures.push(self.put(&figure.png_name(), &figure.drawn.png)?);
            pictures.push(self.put(&figure.svg_name(), figure.drawn.svg.as_bytes())?);
        }
        Ok(pictures)
    }
}
