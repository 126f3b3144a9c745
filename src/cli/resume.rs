//! `fieldgap resume`: a scan that ended early, finished.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::scan::{Showing, conduct, told};
use crate::rig_file::simulated_devices;
use fieldgap_acquisition::ScanRun;

/// The `resume` command.
#[derive(Debug, Args)]
pub(super) struct Resume {
    /// The folder of the scan
    folder: PathBuf,
    #[command(flatten)]
    showing: Showing,
}

impl Resume {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        self.showing.is_possible()?;
        let ending = conduct(ScanRun::resume(&self.folder, simulated_devices), &self.showing)?;
        Ok(told(&self.folder, &ending))
    }
}
