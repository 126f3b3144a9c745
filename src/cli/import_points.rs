//! `fieldgap import points`: import points that other software measured, after showing what was understood of the file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use jiff::Timestamp;
use miette::{IntoDiagnostic, miette};

use super::output::{fresh_folder, print};
use super::question::agree;
use super::simulate::millimetres;
use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_acquisition::RigSetup;
use fieldgap_exchange::import::{
    Columns, Negative, Order, Points, PointsRequest, Units, read_points,
};
use fieldgap_input::Place;
use fieldgap_records::{FocusSection, PhaseConvention, PhaseSection, RecordedScan, ScanSetup};

/// The arguments of `import points`.
#[derive(Debug, Args)]
pub(super) struct PointsArgs {
    /// File of points: CSV or other text, MATLAB, NumPy, HDF5 or NetCDF
    file: PathBuf,
    /// Columns or variables of x, y, z and the reading, by name or number: x,y,z,p. A common coordinate is written =100.
    /// A complex reading has two columns: x,y,z,re,im or x,y,z,amplitude,phase. Without this option the columns of the
    /// file are listed
    #[arg(long, value_name = "X,Y,Z,READING", allow_hyphen_values = true)]
    columns: Option<Columns>,
    /// Units of these columns. Lengths: m, cm, mm, um, in. Readings: V, mV, uV, Pa, kPa, count, relative, dB (relative to
    /// the largest), dB:1V, dB:20uPa; for a phase rad, deg [default: as the file states]
    #[arg(long, value_name = "UNIT,...")]
    units: Option<Units>,
    /// Description of the set-up, in the format of scan.toml
    #[arg(long, value_name = "FILE", required_unless_present = "rig", conflicts_with_all = ["rig", "focus_mm", "unfocused", "simulator"])]
    setup: Option<PathBuf>,
    /// Rig file, of which array and medium are taken; give --focus-mm or --unfocused with it
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Focus of the array, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = focus, allow_hyphen_values = true, conflicts_with = "unfocused", required_unless_present_any = ["setup", "unfocused"])]
    focus_mm: Option<Vec3>,
    /// All elements were driven in phase
    #[arg(long)]
    unfocused: bool,
    /// Simulator to compare with [default: corrected]
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// Name of the record [default: that of the file, or of the set-up]
    #[arg(long)]
    name: Option<String>,
    /// Number of the driven focus, from 0
    #[arg(long, value_name = "N", default_value = "0", conflicts_with = "drive_column")]
    focus: usize,
    /// Column of the number of the driven focus; -1 where the array was silent
    #[arg(long, value_name = "COLUMN")]
    drive_column: Option<String>,
    /// Column of the times, s [default: the order of the file]
    #[arg(long, value_name = "COLUMN")]
    time_column: Option<String>,
    /// Columns of the standard deviation of the single readings, in the unit of the readings, and of their number
    #[arg(long, value_name = "STD,COUNT", value_parser = two_names)]
    spread_columns: Option<[String; 2]>,
    /// What to do with negative readings
    #[arg(long, value_enum, default_value = "refuse")]
    negative: NegativeArg,
    /// How a phase turns: exp(-iwt) if it grows with the distance from the source, exp(+iwt) if it falls [default: as [phase] of the set-up
    /// states; without both, phases are left out]
    #[arg(long, value_name = "NAME")]
    phase_convention: Option<PhaseConvention>,
    /// Order of the dimensions of an array of readings, such as z,y,x, where lengths and names do not determine it
    #[arg(long, value_name = "AXES")]
    order: Option<Order>,
    /// Folder for the record [default: out/ and the name of the file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Do not ask whether the file was understood
    #[arg(long)]
    yes: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum NegativeArg {
    /// Refuse the file
    Refuse,
    /// Remove the sign
    Rectify,
    /// Leave the reading out
    LeaveOut,
}

impl PointsArgs {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let setup = self.setup.as_deref().map(ScanSetup::read_own).transpose()?;
        let stated = setup.as_ref().and_then(|setup| setup.phase);
        let phase = match self.phase_convention {
            Some(convention) => {
                let known = stated.unwrap_or(PhaseSection::of_drive_sync(convention));
                Some(PhaseSection { convention, ..known })
            }
            None => stated,
        };
        let request = PointsRequest {
            columns: self.columns.clone(),
            units: self.units.clone(),
            time: self.time_column.clone(),
            drive: self.drive_column.clone(),
            focus: self.focus,
            spread: self.spread_columns.clone(),
            negative: match self.negative {
                NegativeArg::Refuse => Negative::Refuse,
                NegativeArg::Rectify => Negative::Rectify,
                NegativeArg::LeaveOut => Negative::LeaveOut,
            },
            phase: phase.is_some(),
            order: self.order.clone(),
        };
        let points = read_points(&self.file, &request)?;
        let summary = points.summary();
        let scan = self.scan(points, setup, phase)?;
        let out = self.out.clone().unwrap_or_else(|| fresh_folder(&name_of(&self.file)));
        // Before the question: an answer is not asked for in vain.
        if out.join("scan.toml").exists() {
            return Err(miette!(
                help = "choose another folder, or move that record away",
                "{} already contains a record",
                out.display()
            ));
        }
        print(&format!("{}\n{summary}", self.file.display()))?;
        if !self.yes {
            agree(
                &format!("The record is written to {}.", out.display()),
                "Is this what the file means?",
                "answer y, or give --yes, if the file was understood; otherwise correct --columns and --units",
            )?;
        }
        scan.write(&out)?;
        print(&format!("{} readings: {}\n", scan.samples.len(), out.display()))?;
        Ok(ExitCode::SUCCESS)
    }

    fn scan(
        &self,
        points: Points,
        setup: Option<ScanSetup>,
        phase: Option<PhaseSection>,
    ) -> miette::Result<RecordedScan> {
        // A record without phases has no use for their meaning.
        let phase =
            phase.filter(|_| points.samples.iter().any(|sample| sample.phase_rad.is_some()));
        if let (Some(path), Some(setup)) = (&self.setup, setup) {
            let mut setup = ScanSetup { phase, ..setup };
            setup.name = self.name.clone().unwrap_or(setup.name);
            return Ok(points.into_scan(setup, path)?);
        }
        let rig_path = self.rig.as_deref().expect("clap asks for a set-up or a rig");
        let rig = RigSetup::read(rig_path)?;
        let setup = ScanSetup {
            name: self.name.clone().unwrap_or_else(|| name_of(&self.file)),
            recorded: modified(&self.file)?,
            unit: points.base.label().to_owned(),
            array: rig.array,
            medium: rig.medium,
            receiver: rig.receiver,
            phase,
            uncertainty: rig.uncertainty,
            simulator: self.simulator.unwrap_or(Simulator::Corrected),
            foci: vec![match self.focus_mm {
                Some(at_mm) => FocusSection::Point(at_mm),
                None => FocusSection::AllZero,
            }],
        };
        Ok(points.into_scan(setup, rig_path)?)
    }
}

pub(super) fn name_of(file: &Path) -> String {
    file.file_stem().map_or_else(|| "imported".to_owned(), |stem| stem.to_string_lossy().into())
}

/// The date of the file: a table contains none.
pub(super) fn modified(file: &Path) -> miette::Result<Timestamp> {
    let modified = std::fs::metadata(file).and_then(|data| data.modified()).into_diagnostic()?;
    Timestamp::try_from(modified).and_then(|at| at.round(jiff::Unit::Second)).into_diagnostic()
}

fn focus(text: &str) -> Result<Vec3, String> {
    let at_mm = millimetres(text)?;
    for along in at_mm.iter() {
        Place::new(*along).map_err(|refused| refused.to_string())?;
    }
    Ok(at_mm)
}

fn two_names(text: &str) -> Result<[String; 2], String> {
    match text.split_once(',') {
        Some((std, count)) if !count.contains(',') => {
            Ok([std.trim().to_owned(), count.trim().to_owned()])
        }
        _ => Err("expected two columns, as std,count".to_owned()),
    }
}
