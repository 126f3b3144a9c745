//! The report of a diagnosis: a folder with one HTML page that needs nothing beside it, its pictures as PNG and SVG, and
//! the diagnosis as text and as JSON.
//!
//! A diagnosis gives the same report every time, byte for byte.

mod causes;
mod figures;
mod gap_budget;
mod guide;
mod heights;
mod odds;
mod open_questions;
mod page;
mod residual_structure;
mod waterfall;

use std::path::{Path, PathBuf};

use self::figures::DiagnosisFigures;
use super::context::ReportContext;
use super::error::ReportError;
use super::folder::Folder;
use fieldgap_diagnosis::Diagnosis;

/// Name of the diagnosis as text.
const TEXT_NAME: &str = "diagnosis.txt";
/// Name of the diagnosis as data.
const JSON_NAME: &str = "diagnosis.json";

/// The files that the report of a diagnosis consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DiagnosisFiles {
    /// The page.
    pub index: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
    /// The text that the terminal shows.
    pub text: PathBuf,
    /// The diagnosis as JSON of format 1.
    pub json: PathBuf,
}

/// Writes the report of a diagnosis into a folder, which is created if it is missing.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_diagnosis(
    dir: &Path,
    context: &ReportContext,
    diagnosis: &Diagnosis,
) -> Result<DiagnosisFiles, ReportError> {
    let figures = DiagnosisFigures::draw(diagnosis)?;
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.all())?;
    let text = folder.put(TEXT_NAME, diagnosis.to_text().as_bytes())?;
    let json = folder.put(JSON_NAME, &serde_json::to_vec_pretty(diagnosis)?)?;
    // The page comes last: where it exists, the report is complete.
    let index = folder.put("index.html", page::page(context, diagnosis, &figures).as_bytes())?;
    Ok(DiagnosisFiles { index, pictures, text, json })
}
