//! The commands, one file each.
//!
//! Exit codes: 0 success; 1 error of a file or device; 2 invalid command line; 3 the scan ended early, and `resume` can
//! complete it; 4 the gap is above a limit; 70 a fault of the program itself; 130 ended immediately by a second signal.

mod blind;
mod blind_rigs;
mod blind_scans;
mod blind_vary;
mod calibrate;
mod campaign;
mod characterize;
mod closed_loop;
mod closing;
mod compare;
mod diagnose;
mod distinguish;
mod driven_rig;
mod error_message;
mod export;
mod exposure;
mod focus;
mod gap;
mod history;
mod import;
mod import_points;
mod init;
mod internal_error;
mod manual;
mod map;
mod note;
mod on;
mod output;
mod pause_signals;
mod permission;
mod picture_args;
mod progress;
mod proposal;
mod question;
mod reanalyse;
mod record_figures;
mod replay;
mod resume;
mod rig;
mod rounds_page;
mod run;
mod scan;
mod sense;
mod serve;
mod serve_user;
mod settings;
mod shard;
mod simulate;
mod simulate_display;
mod simulate_sections;
mod simulate_volume;
mod sounding;
mod stop;
mod study;
mod study_cells;
mod transducers;
mod trust;
mod virtual_ports;
mod volume_planes;
mod watch;
mod watchdog;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

use self::output::{VisibleLog, print, report_error};

/// Exit code of a scan that ended early.
const ENDED_PARTIAL: u8 = 3;

/// Scan an ultrasonic field, simulate the same set-up, and say why the two differ.
#[derive(Debug, Parser)]
#[command(name = "fieldgap", version, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 success; 1 error of a file or device; 2 invalid command line; \
3 the scan ended early (`fieldgap resume` completes it); 4 the gap is above `--fail-above`; 70 an internal error of fieldgap.\n\
FIELDGAP_LOG=debug logs all traffic with the devices.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a rig file and a first plan from a dozen questions
    Init(init::Init),
    /// Run a scan, compare it with the simulation and write a report; diagnose and correct if the plan asks for it
    Run(run::Run),
    /// Run a scan and record it
    Scan(scan::Scan),
    /// Complete a scan that ended early
    Resume(resume::Resume),
    /// Compare a recorded scan with its simulation and write a report
    Replay(replay::Replay),
    /// Compare a recorded scan with its simulation and print the figures
    Compare(compare::Compare),
    /// Diagnose why a recorded scan and its simulation differ
    Diagnose(diagnose::Diagnose),
    /// Compare and diagnose records again, with another simulator or a part of the catalogue; results go beside the old ones
    Reanalyse(reanalyse::Reanalyse),
    /// Make a map of the field with standard errors from a recorded scan
    Map(map::Map),
    /// Predict which causes of a gap a scan can distinguish
    Distinguish(distinguish::Distinguish),
    /// Simulate the field of a plan, of planes above an array, or of a display
    Simulate(simulate::Simulate),
    /// Study how peak, focal radius and sub-peaks depend on a parameter; reproduces the thesis's table and curves
    Study(study::StudyCommand),
    /// Fit decay, directivity and axis of a single transducer to a scan of it, and write a transducer file
    Characterize(characterize::Characterize),
    /// Compare each transducer model with the integral over a vibrating piston
    Transducers(transducers::Transducers),
    /// Play a tactile display on the array: fixed, moving or alternating foci
    Focus(focus::Focus),
    /// Detect hand swipes with four receiving elements
    Sense(sense::Sense),
    /// Import a field that was measured with other software
    Import(import::Import),
    /// Export a record for other programs: NetCDF, HDF5, MATLAB, NumPy or CSV
    Export(export::Export),
    /// Run a virtual rig and print its serial ports
    Virtual(virtual_ports::Virtual),
    /// Run, follow and report campaigns: many scans against many simulations, by a schedule
    Campaign(campaign::CampaignCommand),
    /// Test the diagnosis on scans with sealed causes
    Blind(blind::Blind),
    /// Measure what each element of an array emits, and check it by a second scan; or find it from recorded scans
    Calibrate(calibrate::Calibrate),
    /// Print the sound level where people are, against limits of exposure, and the time with the array driven
    Exposure(exposure::ExposureCommand),
    /// Check and operate a rig by hand
    Rig(rig::Rig),
    /// Note something about a record, or print its notes
    Note(note::NoteCommand),
    /// List the records below a folder with their gaps and causes, and show how they change
    History(history::History),
    /// Show and operate a rig in a browser
    Serve(serve::Serve),
    /// Run one shard of a batch; started by Slurm's tasks
    #[command(hide = true)]
    Shard(shard::Shard),
    /// Watchdog process; started by the program itself
    #[command(hide = true)]
    Watchdog(watchdog::Watchdog),
    /// Write man pages and completions into a folder
    #[command(hide = true)]
    Manual(manual::Manual),
    /// Print shell completions
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    internal_error::report_panics();
    internal_error::guarded(run)
}

fn run() -> ExitCode {
    let cli = Cli::parse();
    let log = std::env::var("FIELDGAP_LOG")
        .ok()
        .and_then(|levels| levels.parse::<Targets>().ok())
        .unwrap_or_else(|| {
            let watchdog = ("fieldgap_rig::watchdog", LevelFilter::WARN);
            Targets::new().with_default(LevelFilter::ERROR).with_targets([watchdog])
        });
    let lines = tracing_subscriber::fmt::layer()
        // Without colours, so that no escape sequence of a device's answer can be taken for one of them.
        .with_ansi(false)
        .with_writer(VisibleLog::default);
    tracing_subscriber::registry().with(lines.with_filter(log)).init();
    match cli.command.run() {
        Ok(code) => code,
        Err(report) => {
            report_error(&report);
            ExitCode::FAILURE
        }
    }
}

impl Command {
    fn run(self) -> miette::Result<ExitCode> {
        match self {
            Self::Init(command) => command.run(),
            Self::Run(command) => command.run(),
            Self::Scan(command) => command.run(),
            Self::Resume(command) => command.run(),
            Self::Replay(command) => command.run(),
            Self::Compare(command) => command.run(),
            Self::Diagnose(command) => command.run(),
            Self::Reanalyse(command) => command.run(),
            Self::Map(command) => command.run(),
            Self::Distinguish(command) => command.run(),
            Self::Simulate(command) => command.run(),
            Self::Study(command) => command.run(),
            Self::Characterize(command) => command.run(),
            Self::Transducers(command) => command.run(),
            Self::Focus(command) => command.run(),
            Self::Sense(command) => command.run(),
            Self::Import(command) => command.run(),
            Self::Export(command) => command.run(),
            Self::Virtual(command) => command.run(),
            Self::Campaign(command) => command.run(),
            Self::Blind(command) => command.run(),
            Self::Calibrate(command) => command.run(),
            Self::Exposure(command) => command.run(),
            Self::Rig(command) => command.run(),
            Self::Note(command) => command.run(),
            Self::History(command) => command.run(),
            Self::Serve(command) => command.run(),
            Self::Shard(command) => command.run(),
            Self::Watchdog(command) => command.run(),
            Self::Manual(command) => command.run(Cli::command()),
            Self::Completions { shell } => {
                let mut script = Vec::new();
                clap_complete::generate(shell, &mut Cli::command(), "fieldgap", &mut script);
                print(&String::from_utf8_lossy(&script))?;
                Ok(ExitCode::SUCCESS)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
