//! The report of a comparison: a folder with one HTML page that needs nothing beside it, the maps and
//! curves as PNG and SVG, and the figures as tables.
//!
//! A comparison gives the same report every time, byte for byte: there is no clock and no chance in it.

mod context;
mod diagnosis;
mod display;
mod error;
mod figure;
mod figures;
mod folder;
mod html;
mod judgement;
mod page;
mod peak_distance;
mod picture;
mod plane_table;
mod provenance;
mod study;
mod tables;
mod transducer;
mod transducer_models;
mod verdict;
mod words;

use std::path::{Path, PathBuf};

pub use self::context::{InputFile, ReportContext};
pub use self::diagnosis::{DiagnosisFiles, write_diagnosis};
pub use self::display::{DisplayFiles, DisplayShown, write_display};
pub use self::error::{PictureError, ReportError};
pub use self::study::{StudyFiles, write_study};
pub use self::tables::csv;
pub use self::transducer::{TransducerFiles, write_transducer};
pub use self::transducer_models::write_transducer_models;

use self::figures::Figures;
use self::folder::Folder;
use fieldgap_comparison::Comparison;

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
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.all())?;
    let text = folder.put(tables::TEXT_NAME, tables::text(comparisons).as_bytes())?;
    let csv = folder.put(tables::CSV_NAME, tables::csv(comparisons).as_bytes())?;
    let json = folder.put(tables::JSON_NAME, &serde_json::to_vec(comparisons)?)?;
    // The page last: where it stands, the report is whole.
    let index = folder.put("index.html", page::page(context, comparisons, &figures).as_bytes())?;
    Ok(ReportFiles { index, pictures, text, csv, json })
}
