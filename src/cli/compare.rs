//! `fieldgap compare`: compare a recorded scan with its simulation, or with another record, and print the figures.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use miette::IntoDiagnostic;

use super::diagnose::context_of_all;
use super::gap::GapLimit;
use super::output::{print, print_json, say};
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{
    Aligning, Change, Comparison, Registering, Scaling, aligned_change, compare,
    compare_by_amplitudes,
};
use fieldgap_diagnosis::ChangeDiagnosis;
use fieldgap_records::{Plan, RecordedScan};

/// How scans are compared, for `compare`, `run` and `replay`.
#[derive(Debug, Default, Args)]
pub(super) struct ComparisonArgs {
    /// Simulators to compare with, see `simulate --help` [default: as in the scan]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    simulator: Vec<Simulator>,
    /// How the scan is aligned and scaled to the simulation, or a second record to the first [default: auto; a second record is
    /// compared as read]
    #[arg(long, value_enum)]
    register: Option<Register>,
    /// Align by the amplitudes alone, also where readings have a phase
    #[arg(long)]
    amplitude_only: bool,
    /// Print every column of the table, wider than 80 characters
    #[arg(long)]
    wide: bool,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum Register {
    #[default]
    /// Gain and a small shift; the whole pose if that explains the gap
    Auto,
    /// Mirror image, rotation, step ratio, shift and gain
    Pose,
    /// Gain and a shift of any size
    Shift,
    /// Gain and a small shift
    GainAndShift,
    /// Gain only
    Gain,
    /// No alignment
    None,
}

impl From<Register> for Registering {
    fn from(register: Register) -> Self {
        match register {
            Register::Auto => Self::Auto,
            Register::Pose => Self::Pose,
            Register::Shift => Self::Shift,
            Register::GainAndShift => Self::GainAndShift,
            Register::Gain => Self::GainOnly,
            Register::None => Self::None,
        }
    }
}

/// The `compare` command.
#[derive(Debug, Args)]
pub(super) struct Compare {
    /// Folder of the recorded scan
    folder: PathBuf,
    /// Folder of another record of the same field: what changed from the first to it [default: the scan is compared with its simulation]
    #[arg(conflicts_with_all = ["simulator", "wide", "amplitude_only"])]
    other: Option<PathBuf>,
    #[command(flatten)]
    comparison: ComparisonArgs,
    #[command(flatten)]
    limit: GapLimit,
    /// Write the difference of the two records as a page into this folder
    #[arg(long, value_name = "DIR", requires = "other")]
    report: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// The same as --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// A table
    Text,
    /// One row per height
    Csv,
    /// Everything, maps included
    Json,
}

impl Compare {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let scan = RecordedScan::open(&self.folder)?;
        if let Some(other) = &self.other {
            return self.changed([&self.folder, other], [scan, RecordedScan::open(other)?]);
        }
        let comparisons = self.comparison.compare(&self.folder, &scan)?;
        match self.format {
            Format::Json => print_json(&comparisons)?,
            _ if self.json => print_json(&comparisons)?,
            Format::Text => {
                for comparison in &comparisons {
                    print(&(self.comparison.text(comparison) + "\n"))?;
                }
            }
            Format::Csv => print(&fieldgap_report::csv(&comparisons))?,
        }
        Ok(self.limit.exit_code(&comparisons))
    }
}

impl Compare {
    /// Compares two records, kept in these folders.
    fn changed(
        &self,
        folders: [&PathBuf; 2],
        scans: [RecordedScan; 2],
    ) -> miette::Result<ExitCode> {
        let [a, b] = &scans;
        let (aligning, scaling) = match self.comparison.register {
            None | Some(Register::None) => (Aligning::None, Scaling::AsRead),
            Some(Register::Gain) => (Aligning::None, Scaling::Gain),
            Some(Register::Shift) => (Aligning::Shift, Scaling::AsRead),
            Some(Register::GainAndShift) => (Aligning::Shift, Scaling::Gain),
            Some(Register::Pose) => (Aligning::Pose, Scaling::Gain),
            Some(Register::Auto) if a.setup.unit != b.setup.unit => (Aligning::Auto, Scaling::Gain),
            Some(Register::Auto) => (Aligning::Auto, Scaling::AsRead),
        };
        let change = aligned_change(a, b, aligning, scaling).into_diagnostic()?;
        match self.format {
            Format::Json => print_json(&change)?,
            _ if self.json => print_json(&change)?,
            Format::Text => print(&change.to_text())?,
            Format::Csv => print(&change.to_csv())?,
        }
        if let Some(out) = &self.report {
            let page = write_change_page(out, &folders.map(PathBuf::clone), &scans, &change, None)?;
            say(format!("report: {}", page.display()));
        }
        Ok(self.limit.exit_code_of(change.overall.gap * 100.0, "the difference"))
    }
}

/// Writes the page of two records, kept in these folders, into the folder `out`, with the cause of the change if it is known; gives the page.
pub(super) fn write_change_page(
    out: &Path,
    folders: &[PathBuf],
    scans: &[RecordedScan],
    change: &Change,
    cause: Option<&ChangeDiagnosis>,
) -> miette::Result<PathBuf> {
    let context = context_of_all(folders, scans)?;
    let files = fieldgap_report::write_change(out, &context, change, cause).into_diagnostic()?;
    for warning in &context.warnings {
        say(warning);
    }
    Ok(files.index)
}

impl ComparisonArgs {
    /// Compares a scan, kept in `folder`, with each simulator.
    pub(super) fn compare(
        &self,
        folder: &Path,
        scan: &RecordedScan,
    ) -> miette::Result<Vec<Comparison>> {
        self.simulators(folder, scan)?
            .into_iter()
            .map(|simulator| self.compare_with(scan, simulator))
            .collect()
    }

    /// A comparison as text, in the width that was asked for.
    pub(super) fn text(&self, comparison: &Comparison) -> String {
        match self.wide {
            true => comparison.to_wide_text(),
            false => comparison.to_text(),
        }
    }

    /// Compares a scan with one simulator.
    pub(super) fn compare_with(
        &self,
        scan: &RecordedScan,
        simulator: Simulator,
    ) -> miette::Result<Comparison> {
        let compare = match self.amplitude_only {
            true => compare_by_amplitudes,
            false => compare,
        };
        let registering = self.register.unwrap_or(Register::Auto).into();
        compare(scan, simulator, registering).into_diagnostic()
    }

    /// The requested simulators; by default that of the scan, and further ones named in its plan.
    fn simulators(&self, folder: &Path, scan: &RecordedScan) -> miette::Result<Vec<Simulator>> {
        if !self.simulator.is_empty() {
            return Ok(self.simulator.clone());
        }
        let plan = folder.join("plan.toml");
        let also = if plan.exists() { Plan::read(&plan)?.also } else { Vec::new() };
        let mut simulators = vec![scan.setup.simulator];
        simulators.extend(also.into_iter().filter(|also| *also != scan.setup.simulator));
        Ok(simulators)
    }
}
