//! A picture of each transducer model, compared with the integral over a vibrating face.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::{PictureError, ReportError};
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{Drawn, ModelCurves};
use fieldgap_study::ModelAgainstIntegral;

/// Writes a picture of each model into a folder, which is created if it is missing; gives the pictures, PNG and SVG.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_transducer_models(
    dir: &Path,
    models: &[ModelAgainstIntegral],
) -> Result<Vec<PathBuf>, ReportError> {
    let figures: Vec<Figure> = models
        .par_iter()
        .map(|model| Ok(Figure::new(model.simulator.to_string(), Drawn::new(&ModelCurves(model))?)))
        .collect::<Result<_, PictureError>>()?;
    Folder::make(dir)?.put_figures(figures.iter())
}
