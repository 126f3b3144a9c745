//! `fieldgap rig`: looking after a rig.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use miette::IntoDiagnostic;

use super::output::{print, print_json};
use crate::campaign::{Lab, open_virtual};
use crate::rig::check::check;
use crate::virtual_rig::VirtualRig;

/// The `rig` command.
#[derive(Debug, Args)]
pub(super) struct Rig {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Talk to each device, measure latency and noise, and say what to mend; nothing moves
    Check {
        /// The rig file
        rig: PathBuf,
        /// Print what was found as JSON
        #[arg(long)]
        json: bool,
    },
}

impl Rig {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let Task::Check { rig, json } = self.task;
        let lab = Lab::read(&rig)?;
        let firmware = open_virtual(&lab)?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let elements = lab.believed_array().len();
        let report = runtime.block_on(check(&lab.rig, &ports, elements));
        if json {
            print_json(&report)?;
        } else {
            print(&format!("{report}\n"))?;
        }
        Ok(if report.can_scan() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
