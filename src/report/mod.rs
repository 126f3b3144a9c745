//! The report of a comparison: a folder with one HTML page that needs nothing beside it, the maps and
//! curves as PNG and SVG, and the figures as tables.
//!
//! A comparison gives the same report every time, byte for byte: there is no clock and no chance in it.

mod context;
mod error;
mod figures;
mod judgement;
mod numbers;
mod page;
mod peak_distance;
mod picture;
mod tables;
mod verdict;
mod words;

use std::path::{Path, PathBuf};

pub use self::context::{InputFile, ReportContext};
pub use self::error::{PictureError, ReportError};
pub use self::tables::csv;

use self::figures::Figures;
use crate::gap::Comparison;

/// The files that a report consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportFiles {
    /// The page.
    pub index: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
    /// The figures as a table for people.
    pub text: PathBuf,
    /// The figures as a table for programs, one row for each simulator, drive and height.
    pub csv: PathBuf,
    /// The comparisons in full, maps and all, as a list.
    pub json: PathBuf,
}

/// Writes the report of a scan into a folder, which is made where it is missing: one comparison for each
/// simulator (each simulator once), all of the same scan.
///
/// # Errors
/// [`ReportError`] if there is no comparison, or if a file cannot be written.
pub fn write(
    dir: &Path,
    context: &ReportContext,
    comparisons: &[Comparison],
) -> Result<ReportFiles, ReportError> {
    if comparisons.is_empty() {
        return Err(ReportError::NothingCompared);
    }
    let figures = Figures::draw(comparisons)?;
    std::fs::create_dir_all(dir).map_err(ReportError::write(dir))?;
    let put = |name: &str, bytes: &[u8]| {
        let path = dir.join(name);
        std::fs::write(&path, bytes).map_err(ReportError::write(&path))?;
        Ok::<PathBuf, ReportError>(path)
    };
    let mut pictures = Vec::new();
    for figure in figures.all() {
        pictures.push(put(&figure.png_name(), &figure.drawn.png)?);
        pictures.push(put(&figure.svg_name(), figure.drawn.svg.as_bytes())?);
    }
    let text = put(tables::TEXT_NAME, tables::text(comparisons).as_bytes())?;
    let csv = put(tables::CSV_NAME, tables::csv(comparisons).as_bytes())?;
    let json = put(tables::JSON_NAME, &serde_json::to_vec(comparisons)?)?;
    // The page last: where it stands, the report is whole.
    let index = put("index.html", page::page(context, comparisons, &figures).as_bytes())?;
    Ok(ReportFiles { index, pictures, text, csv, json })
}
