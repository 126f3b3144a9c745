//! `fieldgap import`: import measured fields as recorded scans.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand, ValueEnum};
use miette::miette;

use super::import_points::{PointsArgs, modified, name_of};
use super::output::print;
use super::simulate::{length, place};
use fieldgap_acoustics::Simulator;
use fieldgap_input::{Place, Positive};
use fieldgap_records::import::{
    Anchor, FirstRow, GridCsv, GridPlacement, MADE_UP_SECONDS_A_POINT, ThesisLog, ThesisLogSetup,
    TransducerAxis,
};
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};

/// The `import` command.
#[derive(Debug, Args)]
pub(super) struct Import {
    #[command(subcommand)]
    source: Source,
}

#[derive(Debug, Subcommand)]
enum Source {
    /// Log of one transducer in the format of the thesis: three header rows, then x, y, z in cm and the magnitude
    ThesisLog(ThesisLogArgs),
    /// Grids of numbers, one plane per file
    Grid(GridArgs),
    /// Points with their places: text, MATLAB, NumPy, HDF5 or NetCDF
    Points(Box<PointsArgs>),
}

#[derive(Debug, Args)]
struct ThesisLogArgs {
    /// Log file
    log: PathBuf,
    /// Folder for the record
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Position of the transducer in logged coordinates, mm [default: below the largest reading]
    #[arg(long, value_name = "X,Y", value_parser = pair, allow_hyphen_values = true)]
    axis_mm: Option<[f64; 2]>,
    /// Simulator to compare with
    #[arg(long, value_name = "NAME", default_value = "corrected")]
    simulator: Simulator,
}

#[derive(Debug, Args)]
struct GridArgs {
    /// Files with rows of numbers, separated by commas, semicolons or tabs
    #[arg(required = true)]
    grids: Vec<PathBuf>,
    /// Description of the set-up, in the format of scan.toml
    #[arg(long, value_name = "FILE")]
    setup: PathBuf,
    /// Height of the plane of each file, mm
    #[arg(long, value_name = "Z,...", value_delimiter = ',', value_parser = place, required = true)]
    z_mm: Vec<f64>,
    /// Step between neighbouring points, mm
    #[arg(long, value_name = "MM", value_parser = length)]
    step_mm: Positive,
    /// Corner of smallest x and y, mm [default: the grid is centred on the axis]
    #[arg(long, value_name = "X,Y", value_parser = pair, allow_hyphen_values = true)]
    corner_mm: Option<[f64; 2]>,
    /// Whether the first row has the largest y (top) or the smallest (bottom)
    #[arg(long, value_enum, default_value = "top")]
    first_row: Row,
    /// Number of the driven focus, from 0
    #[arg(long, value_name = "N", default_value = "0")]
    focus: usize,
    /// Folder for the record
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Row {
    Top,
    Bottom,
}

impl Import {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let (record, out) = match self.source {
            Source::ThesisLog(args) => (args.read()?, args.out),
            Source::Grid(args) => (args.read()?, args.out),
            Source::Points(args) => return args.run(),
        };
        record.write(&out)?;
        print(&format!("{} readings: {}\n", record.samples.len(), out.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

impl ThesisLogArgs {
    fn read(&self) -> miette::Result<RecordedScan> {
        let log = ThesisLog::read(&self.log)?;
        let setup = ThesisLogSetup {
            axis: self.axis_mm.map_or(TransducerAxis::UnderLargest, TransducerAxis::At),
            simulator: self.simulator,
            ..ThesisLogSetup::of_thesis(&name_of(&self.log), modified(&self.log)?)
        };
        Ok(log.into_scan(setup))
    }
}

impl GridArgs {
    fn read(&self) -> miette::Result<RecordedScan> {
        if self.grids.len() != self.z_mm.len() {
            return Err(miette!(
                help = "give one height per file, as --z-mm 50,100",
                "there are {} files and {} heights",
                self.grids.len(),
                self.z_mm.len()
            ));
        }
        let setup = ScanSetup::read_own(&self.setup)?;
        if self.focus >= setup.foci.len() {
            return Err(miette!(
                help = "[[focus]] entries are numbered from 0",
                "{} has {} [[focus]] entries, but --focus is {}",
                self.setup.display(),
                setup.foci.len(),
                self.focus
            ));
        }
        let mut samples = Vec::new();
        for (file, &z_mm) in self.grids.iter().zip(&self.z_mm) {
            let grid = GridCsv::read(file)?;
            let placement = GridPlacement {
                z_mm,
                step_mm: [self.step_mm; 2].into(),
                anchor: self.corner_mm.map_or(Anchor::Centre([0.0; 2]), Anchor::LeastCorner),
                first_row: match self.first_row {
                    Row::Top => FirstRow::Top,
                    Row::Bottom => FirstRow::Bottom,
                },
            };
            let from_s = samples
                .last()
                .map_or(0.0, |last: &RecordedSample| last.time_s + MADE_UP_SECONDS_A_POINT);
            samples.extend(grid.samples(&placement, self.focus, from_s));
        }
        Ok(RecordedScan { setup, samples })
    }
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y] if text.matches(',').count() == 1 => {
            for number in [x, y] {
                Place::new(number).map_err(|refused| refused.to_string())?;
            }
            Ok([x, y])
        }
        _ => Err("expected two numbers, as x,y".to_owned()),
    }
}
