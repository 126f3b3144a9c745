//! `figures.json`: the figures of one comparison of a record with its simulation, without maps.

use std::io;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Comparison, Discrepancy, PlaneComparison};
use fieldgap_diagnosis::Diagnosis;
use fieldgap_input::{Fault, MOST_TEXT, read_text};
use fieldgap_records::{RecordedScan, write_whole};
use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

use crate::air::AirFigures;
use crate::cause::CauseFigures;
use crate::sampling_error::NoisyReadings;

/// Name of the file, in the folder of a report.
pub const FIGURES: &str = "figures.json";

/// The format that this program reads and writes.
const FORMAT: u32 = 1;

/// The folder of the report in that of a record.
const REPORT: &str = "report";

/// The folder of the diagnosis in that of a report.
const WHY: &str = "why";

/// The figures of one comparison of a record with its simulation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordFigures {
    /// The format: 1.
    pub format: u32,
    /// Name and version of the program that computed them.
    pub software: String,
    /// The simulator that the record was compared with.
    pub simulator: Simulator,
    /// Number of readings compared.
    pub points: usize,
    /// Rms of the residual over rms of the readings. Its square contains that of the noise floor. The error is how far noise makes it scatter
    /// from scan to scan.
    pub gap: Uncertain,
    /// The gap that noise alone makes, in the same unit.
    pub noise_floor: f64,
    /// Reading per unit of the simulation, and its standard error with a residual that is alike in neighbouring points.
    pub level: Uncertain,
    /// Pearson's correlation over all readings, and how far noise makes it scatter.
    pub correlation: Uncertain,
    /// By drive, then by height.
    pub heights: Vec<HeightFigures>,
    /// What a diagnosis said; `None` without one.
    #[serde(default)]
    pub cause: Option<CauseFigures>,
    /// The air during the scan; `None` where it was not logged.
    #[serde(default)]
    pub air: Option<AirFigures>,
}

/// The figures at one height, for one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeightFigures {
    /// Number of the drive.
    pub focus: usize,
    /// Height in the scan's coordinates, mm.
    pub z_mm: f64,
    /// As over all readings, at the gain of all.
    pub gap: Uncertain,
    /// As over all readings.
    pub correlation: Uncertain,
    /// Peak of the scan over peak of the simulation.
    #[serde(default)]
    pub peak_ratio: Option<Uncertain>,
    /// Distance from the simulated peak to the scanned one, mm.
    #[serde(default)]
    pub peak_offset_mm: Option<Uncertain>,
    /// Focal radius of the scan less that of the simulation, mm.
    #[serde(default)]
    pub focal_radius_mm: Option<Uncertain>,
}

impl RecordFigures {
    /// The figures of a comparison of `scan`, with the diagnosis and the air where there are any.
    pub fn of(
        scan: &RecordedScan,
        comparison: &Comparison,
        diagnosis: Option<&Diagnosis>,
        air: Option<AirFigures>,
    ) -> Self {
        let noisy = NoisyReadings::of(scan, comparison);
        let gain = comparison.registration.gain;
        Self {
            format: FORMAT,
            software: concat!("fieldgap ", env!("CARGO_PKG_VERSION")).to_owned(),
            simulator: comparison.simulator,
            points: comparison.points,
            gap: Uncertain {
                value: comparison.overall.residual_rms_ratio,
                standard_error: noisy.gap_error(noisy.all()),
            },
            noise_floor: noisy.noise_floor(),
            level: Uncertain { value: gain.value, standard_error: gain.standard_error },
            correlation: Uncertain {
                value: comparison.overall.correlation,
                standard_error: noisy.correlation_error(noisy.all()),
            },
            heights: comparison
                .planes
                .iter()
                .map(|plane| HeightFigures::of(plane, &noisy))
                .collect(),
            cause: diagnosis.map(CauseFigures::of),
            air,
        }
    }

    /// Writes them as `figures.json` into the folder of a report; gives the file.
    ///
    /// # Errors
    /// What the file system reports; an older file then still exists.
    pub fn write(&self, report_folder: &Path) -> io::Result<PathBuf> {
        let path = report_folder.join(FIGURES);
        let mut json = serde_json::to_vec_pretty(self)?;
        json.push(b'\n');
        write_whole(&path, |file| io::Write::write_all(file, &json))?;
        Ok(path)
    }

    /// The figures of the record in a folder, from the folder `report` in it; `None` where there are none. Where they have no cause, that of
    /// `report/why` is taken, if it is about the same simulator.
    ///
    /// # Errors
    /// A [`Fault`] where a file cannot be read, or has another format.
    pub fn read(record_folder: &Path) -> Result<Option<Self>, Fault> {
        let report = record_folder.join(REPORT);
        let Some(mut figures) = Self::read_file(&report.join(FIGURES))? else { return Ok(None) };
        if figures.cause.is_none() {
            let why = Self::read_file(&report.join(WHY).join(FIGURES))?;
            let same = |why: &Self| why.simulator == figures.simulator;
            figures.cause = why.filter(same).and_then(|why| why.cause);
        }
        Ok(Some(figures))
    }

    /// The figures in one file; `None` where it does not exist.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_file(path: &Path) -> Result<Option<Self>, Fault> {
        let text = match read_text(path, MOST_TEXT) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => {
                let problem = format!("cannot be read: {error}");
                return Err(Fault::of_file(path, problem, "check the file"));
            }
        };
        Self::parse(path, &text).map(Some)
    }

    /// Reads the text of a `figures.json`; `path` is for the message.
    ///
    /// # Errors
    /// A [`Fault`] that says what is wrong.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Fault> {
        /// Read first: a later format may have other keys.
        #[derive(Deserialize)]
        struct Format {
            format: u32,
        }
        let remedy = "compare the record again, which writes the file anew: `fieldgap replay`";
        let fault = |problem: String| Fault::of_file(path, problem, remedy);
        let not_json = |error: serde_json::Error| fault(format!("holds no figures: {error}"));
        let Format { format } = serde_json::from_str(text).map_err(not_json)?;
        if format != FORMAT {
            return Err(fault(format!(
                "has format {format}; this program reads format {FORMAT}, a later one may read it"
            )));
        }
        let figures: Self = serde_json::from_str(text).map_err(not_json)?;
        if figures.gap.value < 0.0 || figures.correlation.value.abs() > 1.0 + 1e-9 {
            return Err(fault("has a gap below zero or a correlation beyond ±1".to_owned()));
        }
        Ok(figures)
    }
}

impl HeightFigures {
    fn of(plane: &PlaneComparison, noisy: &NoisyReadings) -> Self {
        let z_mm = plane.z_m * 1e3;
        let range = noisy.plane(plane.focus, z_mm);
        let error = |of: fn(&NoisyReadings, std::ops::Range<usize>) -> f64| {
            range.clone().map_or(f64::NAN, |range| of(noisy, range))
        };
        let Discrepancy { peak_ratio, peak_distance_m, focal_radius_m, .. } = &plane.discrepancy;
        let existing = |figure: &Uncertain| figure.value.is_finite().then_some(*figure);
        let in_mm = |length_m: Uncertain| Uncertain {
            value: length_m.value * 1e3,
            standard_error: length_m.standard_error * 1e3,
        };
        Self {
            focus: plane.focus,
            z_mm,
            gap: Uncertain {
                value: plane.agreement.residual_rms_ratio,
                standard_error: error(NoisyReadings::gap_error),
            },
            correlation: Uncertain {
                value: plane.agreement.correlation,
                standard_error: error(NoisyReadings::correlation_error),
            },
            peak_ratio: existing(peak_ratio),
            peak_offset_mm: existing(peak_distance_m).map(in_mm),
            focal_radius_mm: focal_radius_m.map(in_mm),
        }
    }
}
