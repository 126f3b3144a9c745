//! The files of a characterized transducer: the findings as text and tables, pictures, and the transducer file.

use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::figure::Figure;
use super::folder::Folder;
use super::picture::{Drawn, PolarLobe, ResidualPlanes, TransducerCurves};
use fieldgap_acoustics::Vec3;
use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_characterization::{Characterization, Readings, csv};
use fieldgap_records::{OFF_LINE_MM, Plane, RecordedSample, TransducerFile, plane_map};

/// The files of a characterization.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TransducerFiles {
    /// The transducer file.
    pub transducer: PathBuf,
    /// The pictures, PNG and SVG.
    pub pictures: Vec<PathBuf>,
}

/// Writes the results of a characterization into a folder, which is created if it is missing; `text` holds the findings.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_transducer(
    dir: &Path,
    found: &Characterization,
    readings: &Readings,
    file: &TransducerFile,
    text: &str,
) -> Result<TransducerFiles, ReportError> {
    let mut figures = vec![
        Figure::new(
            "curves".to_owned(),
            Drawn::new(&TransducerCurves::new(found, &readings.unit))?,
        ),
        Figure::new("polar".to_owned(), Drawn::new(&PolarLobe::new(found))?),
    ];
    if let Some(picture) = ResidualPlanes::new(residual_maps(found, readings)) {
        figures.push(Figure::new("residuals".to_owned(), Drawn::new(&picture)?));
    }
    let folder = Folder::make(dir)?;
    folder.put("characterization.txt", text.as_bytes())?;
    folder.put("models.csv", csv(found).as_bytes())?;
    folder.put("profile.json", &serde_json::to_vec_pretty(&found.profile)?)?;
    let pictures = folder.put_figures(figures.iter())?;
    let transducer = folder.put("transducer.toml", file.text().as_bytes())?;
    Ok(TransducerFiles { transducer, pictures })
}

/// Heights (millimetres) and the residuals of the best pair of laws there, divided by their rms over all readings. Heights
/// that were not scanned on a grid are left out.
fn residual_maps(found: &Characterization, readings: &Readings) -> Vec<(f64, PlaneMap)> {
    let best = found.best();
    let predicted = best.predicted(readings);
    let residual = |index: usize| (readings.values[index] - predicted[index]) / best.residual_rms;
    (0..readings.heights_m.len())
        .filter_map(|height| {
            let samples: Vec<RecordedSample> = (0..readings.values.len())
                .filter(|&index| readings.height_of[index] == height)
                .map(|index| {
                    let at_m: Vec3 = readings.at_m[index];
                    RecordedSample::measured(0.0, Some(0), at_m, residual(index), None)
                })
                .collect();
            let z_mm = readings.heights_m[height] * 1e3;
            let plane = Plane { focus: 0, z_mm, samples: samples.iter().collect() };
            Some((z_mm, plane_map(&plane, OFF_LINE_MM).ok()?.map))
        })
        .collect()
}
