//! `fieldgap run`: run a scan, compare it with the simulation and write a report; diagnose and correct if the plan asks for it.

use std::process::ExitCode;

use clap::Args;

use super::closing::close_gap;
use super::compare::ComparisonArgs;
use super::replay::report_on;
use super::scan::{ScanArgs, Scanned, report_ending};
use crate::cli::output::say;
use fieldgap_acquisition::Ending;

/// The `run` command.
#[derive(Debug, Args)]
pub(super) struct Run {
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    comparison: ComparisonArgs,
}

impl Run {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let Scanned::Done { folder, ending, diagnose } = self.scan.scan()? else {
            return Ok(ExitCode::SUCCESS);
        };
        let report = folder.join("report");
        report_on(&folder, &self.comparison, &report)?;
        if diagnose {
            match ending {
                Ending::Complete => close_gap(&folder, &self.comparison, &report)?,
                Ending::Partial { .. } => {
                    say("not diagnosed: the scan ended early");
                }
            }
        }
        Ok(report_ending(&folder, &ending))
    }
}
