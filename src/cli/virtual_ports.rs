//! `fieldgap virtual`: run a virtual rig on serial ports for other programs.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::driven_rig::{Links, write_rig};
use super::output::{print, print_json};
use crate::rig_file::RigFile;

/// The `virtual` command.
#[derive(Debug, Args)]
pub(super) struct Virtual {
    /// Rig file with a [virtual] section
    rig: PathBuf,
    /// Print the ports as JSON
    #[arg(long)]
    json: bool,
    /// Write the rig file that drives these ports, beside the given one
    #[arg(long, value_name = "FILE")]
    write_rig: Option<PathBuf>,
    /// Folder for links to the ports, which keep their names: robot, receiver, array
    #[arg(long, value_name = "DIR")]
    links: Option<PathBuf>,
}

impl Virtual {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.rig)?.on_wall_clock();
        let firmware = rig_file.open_virtual()?.ok_or_else(|| {
            miette!(
                help = "add a [virtual] section, as in rigs/virtual.toml",
                "{} describes a real rig",
                self.rig.display()
            )
        })?;
        let mut ports = firmware.ports();
        let links =
            self.links.as_ref().map(|folder| Links::make(folder, &mut ports)).transpose()?;
        if let Some(file) = &self.write_rig {
            write_rig(&self.rig, file, &ports)?;
        }
        if self.json {
            print_json(&serde_json::json!({
                "motion": ports.motion,
                "receiver": ports.receiver,
                "focus_array": ports.focus_array,
                "environment": ports.environment,
            }))?;
        } else {
            let mut text = String::new();
            for (device, port) in [
                ("robot (Marlin)", &ports.motion),
                ("receiver", &ports.receiver),
                ("array", &ports.focus_array),
            ] {
                text += &format!("{device:<15} {}\n", port.as_deref().unwrap_or("-"));
            }
            if let Some(port) = &ports.environment {
                text += &format!("{:<15} {port}\n", "environment");
            }
            print(&(text + "Ctrl-C ends it.\n"))?;
        }
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        runtime.block_on(tokio::signal::ctrl_c()).into_diagnostic()?;
        drop(links);
        drop(firmware);
        Ok(ExitCode::SUCCESS)
    }
}
