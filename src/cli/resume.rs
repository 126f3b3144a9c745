//! `fieldgap resume`: complete a scan that ended early.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::closed_loop::resumed;
use super::exposure::Foreseen;
use super::map::{MapRequest, write_map};
use super::permission::{Act, Permission};
use super::scan::{Showing, report_ending, run_scan};
use super::trust::Trust;
use fieldgap_acquisition::{Ending, PlannedScan};

/// The `resume` command.
#[derive(Debug, Args)]
pub(super) struct Resume {
    /// Folder of the scan
    folder: PathBuf,
    #[command(flatten)]
    permission: Permission,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    showing: Showing,
}

impl Resume {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        self.showing.is_possible()?;
        let scan = PlannedScan::of_record(&self.folder)?;
        let hooks = self.trust.in_hooks_of(&scan)?;
        let foreseen = Foreseen::of_scan(&scan)?;
        self.permission.within_limits(foreseen.as_ref(), scan.rig_setup())?;
        self.permission.to(Act::Scan, scan.rig_setup())?;
        let scan_run = resumed(&self.folder);
        let ending = run_scan(scan_run, &hooks, &self.showing)?;
        if scan.plan().adaptive.is_some() && ending == Ending::Complete {
            write_map(&self.folder, MapRequest::default())?;
        }
        Ok(report_ending(&self.folder, &ending))
    }
}
