//! The commands, one file each.
//!
//! Exit codes: 0 done; 1 a fault of a file or a device; 2 the command line was wrong; 3 the scan ended before its plan
//! did, and `resume` can finish it; 130 stopped at once by a second signal.

mod blind;
mod characterize;
mod closing;
mod compare;
mod diagnose;
mod distinguish;
mod focus;
mod import;
mod output;
mod progress;
mod replay;
mod resume;
mod rig;
mod run;
mod scan;
mod sense;
mod simulate;
mod simulate_display;
mod simulate_volume;
mod stop;
mod study;
mod transducers;
mod virtual_ports;
mod watch;
mod watchdog;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

/// Exit code of a scan that ended before its plan did.
const ENDED_PARTIAL: u8 = 3;

/// Scan an ultrasonic field, simulate the same set-up, and say why the two differ.
#[derive(Debug, Parser)]
#[command(name = "fieldgap", version, max_term_width = 100, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 a fault of a file or a device; 2 the command line was wrong; \
3 the scan ended before its plan did (`fieldgap resume` finishes it).\n\
FIELDGAP_LOG=debug shows what is said on every line.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Scan a plan on a rig, compare it with the simulation, and write the report; diagnose and correct if the plan says so
    Run(run::Run),
    /// Scan a plan on a rig and keep the record
    Scan(scan::Scan),
    /// Finish a scan that ended early
    Resume(resume::Resume),
    /// Compare a recorded scan with its simulation and write the report, offline
    Replay(replay::Replay),
    /// Compare a recorded scan with its simulation and print the figures
    Compare(compare::Compare),
    /// Say why a recorded scan and its simulation differ
    Diagnose(diagnose::Diagnose),
    /// Say which causes a scan can tell apart, whatever it reads
    Distinguish(distinguish::Distinguish),
    /// Simulate a plan, planes over a rig's array, or a display
    Simulate(simulate::Simulate),
    /// Say how peak, focal radius and sub-peaks go with any parameter; the thesis's table and curves
    Study(study::StudyCommand),
    /// Find a transducer's decay, lobe and axis in a scan of it alone, and write a transducer file
    Characterize(characterize::Characterize),
    /// Hold each transducer model against the integral over a vibrating face
    Transducers(transducers::Transducers),
    /// Play a display: foci that stand, move and alternate, so that a hand feels them
    Focus(focus::Focus),
    /// Tell swipes of a hand from what four elements hear
    Sense(sense::Sense),
    /// Bring in a field that was measured elsewhere
    Import(import::Import),
    /// Keep a virtual rig open, as ports for any program
    Virtual(virtual_ports::Virtual),
    /// Check diagnoses on sets of scans whose causes are sealed away
    Blind(blind::Blind),
    /// Look after a rig
    Rig(rig::Rig),
    /// Guard the rig of the program that started this
    #[command(hide = true)]
    Watchdog(watchdog::Watchdog),
    /// Print the completions of a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let log = tracing_subscriber::EnvFilter::try_from_env("FIELDGAP_LOG")
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("error"));
    tracing_subscriber::fmt()
        .with_env_filter(log)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr)
        .init();
    // Paths and messages stay whole, so that they can be searched for and copied.
    let whole_lines = |_: &_| {
        let handler = miette::MietteHandlerOpts::new().wrap_lines(false).terminal_links(false);
        Box::new(handler.build()) as Box<dyn miette::ReportHandler>
    };
    let _ = miette::set_hook(Box::new(whole_lines));
    match cli.command.run() {
        Ok(code) => code,
        Err(report) => {
            eprintln!("{report:?}");
            ExitCode::FAILURE
        }
    }
}

impl Command {
    fn run(self) -> miette::Result<ExitCode> {
        match self {
            Self::Run(command) => command.run(),
            Self::Scan(command) => command.run(),
            Self::Resume(command) => command.run(),
            Self::Replay(command) => command.run(),
            Self::Compare(command) => command.run(),
            Self::Diagnose(command) => command.run(),
            Self::Distinguish(command) => command.run(),
            Self::Simulate(command) => command.run(),
            Self::Study(command) => command.run(),
            Self::Characterize(command) => command.run(),
            Self::Transducers(command) => command.run(),
            Self::Focus(command) => command.run(),
            Self::Sense(command) => command.run(),
            Self::Import(command) => command.run(),
            Self::Virtual(command) => command.run(),
            Self::Blind(command) => command.run(),
            Self::Rig(command) => command.run(),
            Self::Watchdog(command) => command.run(),
            Self::Completions { shell } => {
                clap_complete::generate(
                    shell,
                    &mut Cli::command(),
                    "fieldgap",
                    &mut std::io::stdout(),
                );
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
