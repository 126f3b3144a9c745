//! `fieldgap run`: run a scan, compare it with the simulation, seek the cause of their difference and write a report; correct the set-up if
//! the plan asks for it.

use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::closed_loop::LoopArgs;
use super::closing::{Closing, close};
use super::compare::ComparisonArgs;
use super::gap::{GapLimit, gap_line};
use super::scan::{ScanArgs, Scanned, report_ending};
use crate::cli::output::{print, say};
use fieldgap_acquisition::Ending;

/// The `run` command.
#[derive(Debug, Args)]
pub(super) struct Run {
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    in_loop: LoopArgs,
    #[command(flatten)]
    comparison: ComparisonArgs,
    #[command(flatten)]
    limit: GapLimit,
    /// Do not seek the cause of the difference
    #[arg(long)]
    no_diagnose: bool,
}

impl Run {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let Scanned::Done { folder, ending, diagnose, is_map } = self.scan.scan(&self.in_loop)?
        else {
            return Ok(ExitCode::SUCCESS);
        };
        let report = folder.join("report");
        let closing = match ending {
            _ if self.no_diagnose => Closing::Comparison,
            Ending::Partial { .. } => {
                say("not diagnosed: the scan ended early");
                Closing::Comparison
            }
            Ending::Complete if diagnose => Closing::Correction,
            Ending::Complete if is_map => Closing::Comparison,
            Ending::Complete => Closing::Cause,
        };
        let comparisons = close(&folder, &self.comparison, &report, closing)?;
        if self.scan.prints_json() {
            print(&gap_line(&comparisons, &report).into_diagnostic()?)?;
        }
        let ended = report_ending(&folder, &ending);
        Ok(match ending {
            Ending::Complete => self.limit.exit_code(&comparisons),
            Ending::Partial { .. } => ended,
        })
    }
}
