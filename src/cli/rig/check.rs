//! `fieldgap rig check`: test each device.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::RigArg;
use crate::cli::output::{print, print_json, say};
use crate::rig_file::RigFile;
use fieldgap_acquisition::check_with_transcript;
use fieldgap_rig::check::check;
use fieldgap_virtual_rig::VirtualRig;

/// The `rig check` command.
#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    file: RigArg,
    /// Also write a transcript to a new folder: the rig file, all that passed over the wires, and the result. It can be sent to the
    /// developers; `fieldgap replay DIR --wire` runs the drivers against it
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

impl Check {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        let firmware = rig_file.open_virtual()?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let elements = rig_setup.nominal_array().len();
        let report = match &self.record {
            Some(folder) => runtime.block_on(check_with_transcript(rig_setup, &ports, folder))?,
            None => runtime.block_on(check(&rig_setup.rig, &ports, elements, None)),
        };
        if let Some(folder) = &self.record {
            say(format!("transcript: {}", folder.display()));
        }
        if self.json {
            print_json(&report)?;
        } else {
            print(&format!("{report}\n"))?;
        }
        Ok(if report.can_scan() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
