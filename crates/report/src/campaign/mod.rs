//! The page of a campaign: what changed and where, alarms first, then the cells in rows and columns, figures over time, and small maps.
//!
//! It is written again after every cell. Pictures lie beside it, and only those that changed are drawn again.

mod addresses;
mod alarms;
mod cells;
#[cfg(test)]
mod example;
mod facts;
mod headline;
mod kept;
mod map_file;
mod map_pictures;
mod maps;
mod matrix;
mod next_steps;
mod page;
mod shades;
mod trends;

use std::path::PathBuf;

use self::kept::put;
use super::error::ReportError;
use fieldgap_campaign::Overview;

/// Writes the page of a campaign, `index.html`, into its folder, which is created if it is missing; gives the page's path. Control charts lie
/// beside it in `charts`, small maps of the records in `maps`. Every file is replaced as a whole, so that a reader never finds half of one.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written. A record that cannot be read is no error; the page says so.
pub fn write_campaign(overview: &Overview) -> Result<PathBuf, ReportError> {
    let folder = &overview.folder;
    std::fs::create_dir_all(folder).map_err(ReportError::write(folder))?;
    let trends = trends::trends(overview)?;
    let maps = maps::maps(overview)?;
    // The page comes last: what it shows is then there.
    let index = folder.join("index.html");
    put(&index, page::page(overview, &trends, maps).as_bytes())?;
    Ok(index)
}
