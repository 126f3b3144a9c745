//! `fieldgap resume`: complete a scan that ended early.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::scan::{Showing, report_ending, run_scan};
use crate::rig_file::simulated_devices;
use fieldgap_acquisition::ScanRun;

/// The `resume` command.
#[derive(Debug, Args)]
pub(super) struct Resume {
    /// Folder of the scan
    folder: PathBuf,
    #[command(flatten)]
    showing: Showing,
}

impl Resume {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        self.showing.is_possible()?;
        let ending = run_scan(ScanRun::resume(&self.folder, simulated_devices), &self.showing)?;
        Ok(report_ending(&self.folder, &ending))
    }
}
