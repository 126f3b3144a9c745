//! The files of a study: tables, the findings as text, the study itself, and its pictures.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::{PictureError, ReportError};
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{Drawn, PrintStyle, StudyCurves, StudyField, StudySurfaces};
use fieldgap_study::{Row, Study, StudyResult, csv, draws_csv};

/// The files of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudyFiles {
    /// A row for each combination of values.
    pub csv: PathBuf,
    /// The pictures, PNG and SVG: the three figures against the swept parameters, if they can be drawn, and the field maps
    /// that were kept.
    pub pictures: Vec<PathBuf>,
}

/// Writes the results of a study into a folder, which is created if it is missing; `text` holds the findings.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_study(
    dir: &Path,
    study: &Study,
    result: &StudyResult,
    text: &str,
    style: PrintStyle,
) -> Result<StudyFiles, ReportError> {
    let mut figures = Vec::new();
    if let Some(curves) = StudyCurves::new(study, result) {
        figures.push(Figure::new("study".to_owned(), Drawn::printed(curves, style)?));
    } else if let Some(surfaces) = StudySurfaces::new(study, result) {
        figures.push(Figure::new("study".to_owned(), Drawn::printed(surfaces, style)?));
    }
    let fields: Vec<Option<Figure>> = result
        .rows
        .par_iter()
        .enumerate()
        .map(|(number, row)| field(study, number, row, style))
        .collect::<Result<_, PictureError>>()?;
    figures.extend(fields.into_iter().flatten());
    let folder = Folder::make(dir)?;
    folder.put("study.toml", study.source().text().as_bytes())?;
    folder.put("study.txt", text.as_bytes())?;
    if result.rows.iter().any(|row| row.draws.len() > 1) {
        folder.put("draws.csv", draws_csv(study, result).as_bytes())?;
    }
    let pictures = folder.put_figures(figures.iter())?;
    let csv = folder.put("study.csv", csv(study, result).as_bytes())?;
    Ok(StudyFiles { csv, pictures })
}

fn field(
    study: &Study,
    number: usize,
    row: &Row,
    style: PrintStyle,
) -> Result<Option<Figure>, PictureError> {
    let Some(map) = &row.map else { return Ok(None) };
    let chosen = study.sweeps.iter().zip(&row.values);
    let title: Vec<String> = chosen
        .map(|(sweep, &value)| {
            let last = |key: &String| key.rsplit('.').next().unwrap_or(key).to_owned();
            let names: Vec<String> = sweep.parameters.iter().map(last).collect();
            format!("{} = {}", names.join(" = "), sweep.values[value].label)
        })
        .collect();
    let Some(picture) = StudyField::new(title.join(", "), map, row.focus_m) else {
        return Ok(None);
    };
    Ok(Some(Figure::new(format!("field-{:03}", number + 1), Drawn::printed(picture, style)?)))
}
