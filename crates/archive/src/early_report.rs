//! The figures of a report that has no `figures.json`: those in its `comparison.json`, which is read without keeping its maps.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use fieldgap_acoustics::Simulator;
use fieldgap_input::{Fault, MOST_TABLE, regular};
use fieldgap_text::Uncertain;
use serde::Deserialize;

use crate::figures::{FORMAT, HeightFigures, RecordFigures};

/// The file, in the folder of a report.
pub(crate) const COMPARISON: &str = "comparison.json";

#[derive(Deserialize)]
struct Compared {
    simulator: Simulator,
    points: usize,
    noise: NoiseParts,
    registration: Gain,
    planes: Vec<ComparedPlane>,
    overall: OverReadings,
}

#[derive(Deserialize)]
struct NoiseParts {
    additive: Option<f64>,
    multiplicative: Option<f64>,
}

#[derive(Deserialize)]
struct Gain {
    gain: Uncertain,
}

#[derive(Deserialize)]
struct OverReadings {
    correlation: Option<f64>,
    residual_rms_ratio: Option<f64>,
    scan_rms: Option<f64>,
}

#[derive(Deserialize)]
struct ComparedPlane {
    focus: usize,
    z_m: f64,
    agreement: OverReadings,
    discrepancy: Differences,
}

#[derive(Deserialize)]
struct Differences {
    peak_ratio: Uncertain,
    peak_distance_m: Uncertain,
    focal_radius_m: Option<Uncertain>,
}

/// The figures of the first comparison in the folder of a report; `None` where there is none. The errors of gap and correlation are
/// unknown: they need the readings.
///
/// # Errors
/// A [`Fault`] where the file cannot be read, or has another format.
pub(crate) fn read_early_report(report: &Path) -> Result<Option<RecordFigures>, Fault> {
    let path = report.join(COMPARISON);
    let file = match regular(&path).and_then(|_| File::open(&path)) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(Fault::of_file(
                &path,
                format!("cannot be read: {error}"),
                "check the file",
            ));
        }
    };
    let compared: Vec<Compared> = serde_json::from_reader(BufReader::new(file.take(MOST_TABLE)))
        .map_err(|error| {
            let problem = format!("holds no comparison: {error}");
            let remedy = "compare the record again, which writes the file anew: `fieldgap replay`";
            Fault::of_file(&path, problem, remedy)
        })?;
    Ok(compared.into_iter().next().map(figures))
}

fn figures(compared: Compared) -> RecordFigures {
    let figure = |value: Option<f64>| Uncertain {
        value: value.unwrap_or(f64::NAN),
        standard_error: f64::NAN,
    };
    let existing = |figure: Uncertain| figure.value.is_finite().then_some(figure);
    let in_mm = |length_m: Uncertain| Uncertain {
        value: length_m.value * 1e3,
        standard_error: length_m.standard_error * 1e3,
    };
    let height = |plane: ComparedPlane| HeightFigures {
        focus: plane.focus,
        z_mm: plane.z_m * 1e3,
        gap: figure(plane.agreement.residual_rms_ratio),
        correlation: figure(plane.agreement.correlation),
        peak_ratio: existing(plane.discrepancy.peak_ratio),
        peak_offset_mm: existing(plane.discrepancy.peak_distance_m).map(in_mm),
        focal_radius_mm: plane.discrepancy.focal_radius_m.map(in_mm),
    };
    // The mean over all readings of their variance over their mean square.
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let constant = or_nan(compared.noise.additive) / or_nan(compared.overall.scan_rms);
    RecordFigures {
        format: FORMAT,
        software: "an early version of fieldgap".to_owned(),
        noise_floor: constant.hypot(or_nan(compared.noise.multiplicative)),
        simulator: compared.simulator,
        points: compared.points,
        gap: figure(compared.overall.residual_rms_ratio),
        level: compared.registration.gain,
        correlation: figure(compared.overall.correlation),
        heights: compared.planes.into_iter().map(height).collect(),
        cause: None,
        air: None,
    }
}
