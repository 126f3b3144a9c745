//! The page of two records: what changed between them, and why, if that was asked.

mod page;

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::context::ReportContext;
use super::error::{PictureError, ReportError};
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{ChangeMaps, Drawn, PrintStyle};
use fieldgap_comparison::{Change, HeightChange};
use fieldgap_diagnosis::ChangeDiagnosis;
use fieldgap_text::height_mm;

/// Names of the data files.
const TEXT_NAME: &str = "difference.txt";
const CSV_NAME: &str = "difference.csv";
const JSON_NAME: &str = "difference.json";
const CAUSE_NAME: &str = "cause.json";

/// The files of a page of two records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangeFiles {
    /// The page.
    pub index: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
}

/// Writes the page of two records into a folder, which is created if it is missing: the difference as text, CSV and JSON, the maps of each
/// drive and height, and the page. With the diagnosis of the change, the cause heads the page and is written as JSON.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_change(
    dir: &Path,
    context: &ReportContext,
    change: &Change,
    cause: Option<&ChangeDiagnosis>,
) -> Result<ChangeFiles, ReportError> {
    let figures = figures(change, context.pictures)?;
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.iter().flatten())?;
    folder.put(TEXT_NAME, change.to_text().as_bytes())?;
    folder.put(CSV_NAME, change.to_csv().as_bytes())?;
    folder.put(JSON_NAME, &serde_json::to_vec(change)?)?;
    let mut files = vec![TEXT_NAME, CSV_NAME, JSON_NAME];
    if let Some(cause) = cause {
        folder.put(CAUSE_NAME, &serde_json::to_vec_pretty(cause)?)?;
        files.push(CAUSE_NAME);
    }
    // The page comes last: where it exists, the report is complete.
    let page = page::page(context, change, cause, &figures, &files);
    let index = folder.put("index.html", page.as_bytes())?;
    Ok(ChangeFiles { index, pictures })
}

/// The maps of each drive and height; `None` where its places are no map.
fn figures(change: &Change, style: PrintStyle) -> Result<Vec<Option<Figure>>, PictureError> {
    let draw = |height: &HeightChange| {
        let Some(maps) = ChangeMaps::new(height, &change.unit) else { return Ok(None) };
        let name = format!(
            "change-drive{}-z{}mm",
            height.focus,
            height_mm(height.z_m).replace('\u{2212}', "-")
        );
        let narrow = Drawn::new(&maps.clone().stacked())?;
        Ok(Some(Figure::new(name, Drawn::printed(maps, style)?).with_narrow(narrow)))
    };
    change.heights.par_iter().map(draw).collect()
}
