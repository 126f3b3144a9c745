//! The pictures of a map that was made of readings: amplitude and standard error of each plane, and where was measured.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::{PictureError, ReportError};
use super::figure::Figure;
use super::folder::Folder;
use super::measured_map::MeasuredMap;
use super::picture::{Drawn, MeasuredMaps, PrintStyle};
use fieldgap_text::height_mm;

/// Draws planes of a map into a folder, which is created if it is missing: a picture of each, PNG and SVG. All planes have one colour scale of
/// the amplitude, and one of the standard error. Returns the files.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_measured_map(
    dir: &Path,
    unit: &str,
    planes: &[MeasuredMap],
    style: PrintStyle,
) -> Result<Vec<PathBuf>, ReportError> {
    let largest = |of: fn(&MeasuredMap) -> &Vec<f64>| {
        let values = planes.iter().flat_map(of).copied();
        // Where no value is above zero, any scale shows as much.
        values.reduce(f64::max).filter(|&top| top > 0.0).unwrap_or(1.0)
    };
    let tops = [largest(|plane| &plane.amplitude), largest(|plane| &plane.standard_error)];
    let several_drives = planes.iter().any(|plane| plane.drive != planes[0].drive);
    let figures: Vec<Option<Figure>> = planes
        .par_iter()
        .map(|plane| {
            let Some(maps) = MeasuredMaps::new(plane, unit, tops) else { return Ok(None) };
            let drive =
                if several_drives { format!("-drive{}", plane.drive) } else { String::new() };
            let height = height_mm(plane.grid.z_m).replace('\u{2212}', "-");
            let drawn = Drawn::printed(maps, style)?;
            Ok(Some(Figure::new(format!("map{drive}-z{height}mm"), drawn)))
        })
        .collect::<Result<_, PictureError>>()?;
    Folder::make(dir)?.put_figures(figures.iter().flatten())
}
