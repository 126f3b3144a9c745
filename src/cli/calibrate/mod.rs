//! `fieldgap calibrate`: what each element of an array emits, measured on a rig or found from recorded scans.

mod level;
mod measure;
mod plane;
mod record;
mod text;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::permission::Permission;
use super::scan::Showing;
use super::simulate::{millimetres, positive};
use super::trust::Trust;
use fieldgap_acoustics::{Excitation, Simulation, Simulator, Vec3};
use fieldgap_calibration::{Calibration, StartOutcome, difference, verification};
use fieldgap_input::Positive;
use fieldgap_records::{CalibratedChannel, CalibrationConditions, CalibrationFile, ScanSetup};

/// The `calibrate` command.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Calibrate {
    #[command(subcommand)]
    of: Option<Of>,
    /// Rig file, to measure; or folders of recorded scans of one array
    #[arg(required = true, value_name = "RIG|RECORD")]
    inputs: Vec<PathBuf>,
    /// Time for the coded drives on the robot's clock, minutes
    #[arg(long, value_name = "N", value_parser = positive, default_value = "10")]
    minutes: Positive,
    /// Measure at this place, array frame [default: four places of least variance]; may be given several times
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    at_mm: Vec<Vec3>,
    /// Transducer model of the fit [default: the array's transducer file, or pistons]
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// An earlier calibration of the array, to be compared
    #[arg(long, value_name = "FILE")]
    earlier: Option<PathBuf>,
    /// Another record of the array, which the calibration of records is held against
    #[arg(long, value_name = "RECORD")]
    check: Option<PathBuf>,
    /// Folder for the records and the calibration file [default: out/NAME-calibration]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of the codes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    permission: Permission,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    showing: Showing,
}

/// What else is calibrated.
#[derive(Debug, Subcommand)]
enum Of {
    /// Find the receiver's sensitivity in V/Pa from readings with a sound calibrator on it
    Level(level::CalibrateLevel),
}

/// Name of the calibration file in the folder of a calibration.
const FILE: &str = "calibration.toml";

/// Name of the result as JSON.
const RESULT: &str = "calibration.json";

/// The result, for programs.
#[derive(Debug, Serialize)]
struct CalibrationReport {
    /// The calibration file.
    file: PathBuf,
    elements: usize,
    readings: usize,
    /// Left out while the array warmed up, and as outliers.
    warming_up: usize,
    outliers: usize,
    places: usize,
    drives: usize,
    /// Relative to the rms of the readings.
    noise: f64,
    residual: f64,
    chi_square: f64,
    /// Spread of the sound channels and rms standard errors.
    gain_spread: f64,
    gain_error: f64,
    phase_spread_deg: f64,
    phase_error_deg: f64,
    faults: Vec<Fault>,
    offset_mm: [f64; 3],
    speed_of_sound_m_s: f64,
    further_starts: Vec<StartOutcome>,
    ambiguities: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<record::HeldOut>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap: Option<verification::Gap>,
    #[serde(skip_serializing_if = "Option::is_none")]
    focus: Option<FocusGain>,
    #[serde(skip_serializing_if = "Option::is_none")]
    since_earlier: Option<difference::Difference>,
}

/// A channel that is not sound.
#[derive(Debug, Serialize)]
struct Fault {
    channel: usize,
    state: String,
    drives: usize,
    gain: f64,
    phase_deg: f64,
}

/// Figures of a focus, mean of the lines across it, before and after.
#[derive(Debug, Serialize)]
struct FocusGain {
    at_mm: [f64; 3],
    lines: Vec<[verification::FocusFigures; 2]>,
}

impl Calibrate {
    pub(super) fn run(mut self) -> miette::Result<ExitCode> {
        if let Some(Of::Level(level)) = self.of.take() {
            return level.run();
        }
        self.showing.is_possible()?;
        match &self.inputs[..] {
            [one] if one.is_file() => {
                if self.check.is_some() {
                    return Err(miette!(
                        help = "give --check with a record to be fitted",
                        "a rig is checked by a scan of its own: --check is for records"
                    ));
                }
                self.measure(one)
            }
            _ => self.of_records(),
        }
    }

    fn simulator(&self, has_transducer: bool) -> Simulator {
        let usual = if has_transducer { Simulator::Transducer } else { Simulator::Piston };
        self.simulator.unwrap_or(usual)
    }

    /// What an earlier calibration says, with the difference to this one.
    fn since_earlier(
        &self,
        now: &CalibrationFile,
    ) -> miette::Result<Option<difference::Difference>> {
        let Some(path) = &self.earlier else { return Ok(None) };
        let earlier = CalibrationFile::read(path)?;
        let found = difference::difference(&earlier, now).ok_or_else(|| {
            miette!(
                help = "give an earlier calibration of the same array",
                "{} is of {} channels, and this array has {}",
                path.display(),
                earlier.channels().len(),
                now.channels().len()
            )
        })?;
        Ok(Some(found))
    }
}

/// The simulation of an array as its section describes it, without a calibration.
fn uncalibrated(setup: &ScanSetup, simulator: Simulator) -> Simulation {
    Simulation {
        simulator,
        array: setup.array.uncalibrated().clone(),
        medium: setup.medium.medium(),
        frequency_hz: setup.array.frequency_hz(),
        excitation: Excitation::Uniform,
    }
}

/// How a calibration was found.
struct Summary {
    readings: usize,
    noise: f64,
    residual: f64,
    speed_of_sound_m_s: f64,
}

/// The calibration file of a result.
fn file_of(found: &Calibration, setup: &ScanSetup, hashed: &str) -> CalibrationFile {
    let summary = Summary {
        readings: found.used,
        noise: found.relative_noise,
        residual: found.residual,
        speed_of_sound_m_s: setup.medium.medium().speed_of_sound_m_s
            * (1.0 + found.setting().speed),
    };
    file_with(found.channels.clone(), setup, hashed, &summary)
}

fn file_with(
    channels: Vec<CalibratedChannel>,
    setup: &ScanSetup,
    hashed: &str,
    summary: &Summary,
) -> CalibrationFile {
    let hash: String = Sha256::digest(hashed).iter().map(|byte| format!("{byte:02x}")).collect();
    let conditions = CalibrationConditions {
        array: setup.name.clone(),
        measured: setup.recorded,
        setup_sha256: hash,
        speed_of_sound_m_s: summary.speed_of_sound_m_s,
        readings: summary.readings,
        noise: summary.noise,
        residual: summary.residual,
    };
    CalibrationFile::new(conditions, channels)
}

/// Writes a file of the calibration's folder.
fn write(path: &Path, text: &str) -> miette::Result<()> {
    fieldgap_records::write_whole(path, |file| file.write_all(text.as_bytes()))
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be written", path.display()))
}
