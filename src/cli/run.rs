//! `fieldgap run`: a plan scanned on a rig, compared with its simulation, the report written.

use std::process::ExitCode;

use clap::Args;

use super::compare::ComparisonArgs;
use super::replay::report_on;
use super::scan::{ScanArgs, Scanned, told};

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
        let Scanned::Done { folder, ending } = self.scan.scan()? else {
            return Ok(ExitCode::SUCCESS);
        };
        report_on(&folder, &self.comparison, &folder.join("report"))?;
        Ok(told(&folder, &ending))
    }
}
