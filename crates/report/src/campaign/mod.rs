//! The page of a campaign: what changed and where, alarms first, and a cell of a table for each of its scans.

mod alarms;
mod cells;
mod headline;
mod page;

use std::io::Write;
use std::path::PathBuf;

use super::error::ReportError;
use fieldgap_campaign::Overview;
use fieldgap_records::write_whole;

/// Writes `index.html` into the folder of a campaign, which is created if it is missing; gives the page's path. The page is replaced as a
/// whole, so that a reader never finds half of one.
///
/// # Errors
/// [`ReportError`] if a file cannot be written.
pub fn write_campaign(overview: &Overview) -> Result<PathBuf, ReportError> {
    let folder = &overview.folder;
    std::fs::create_dir_all(folder).map_err(ReportError::write(folder))?;
    let index = folder.join("index.html");
    let page = page::page(overview);
    write_whole(&index, |file| file.write_all(page.as_bytes()))
        .map_err(ReportError::write(&index))?;
    Ok(index)
}
