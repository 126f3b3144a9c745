//! `fieldgap rig stop`: the array silenced and the robot stopped, whoever has them.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use miette::IntoDiagnostic;
use rustix::process::{Pid, Signal, kill_process};
use tokio::time::Instant;

use super::RigArg;
use crate::rig_file::RigFile;
use fieldgap_rig::link::holder_of;
use fieldgap_rig::{Cause, DeviceSelection, ManualRig, Ports, RigConfig, RigError};
use fieldgap_virtual_rig::VirtualRig;

/// How long another fieldgap may take to end safe and let go of its ports.
const LET_GO_WITHIN: Duration = Duration::from_secs(5);

/// How often a port is tried meanwhile.
const TRY_AGAIN: Duration = Duration::from_millis(50);

/// The `rig stop` command.
#[derive(Debug, Args)]
pub(super) struct Stop {
    #[command(flatten)]
    file: RigArg,
}

impl Stop {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        let firmware = rig_file.open_virtual()?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let safe = runtime.block_on(async {
            let mut safe = true;
            for wanted in [
                DeviceSelection { array: true, ..DeviceSelection::default() },
                DeviceSelection { robot: true, ..DeviceSelection::default() },
            ] {
                match open_or_take(&rig_setup.rig, &ports, wanted).await {
                    Ok(mut device) => {
                        let made = device.make_safe("stop").await;
                        safe &= made.is_safe();
                        println_quietly(&made.to_string());
                    }
                    Err(error) => {
                        safe = false;
                        let may = if wanted.array {
                            "THE ARRAY MAY STILL EMIT"
                        } else {
                            "THE ROBOT MAY STILL MOVE"
                        };
                        println_quietly(&format!("{may}: {error}\n  {}", error.remedy()));
                    }
                }
            }
            safe
        });
        if safe {
            println_quietly("the robot's position is unknown now; it homes before its next move");
            Ok(ExitCode::SUCCESS)
        } else {
            println_quietly("switch the devices off by their own switches");
            Ok(ExitCode::FAILURE)
        }
    }
}

/// Opens a device. Another fieldgap that holds it is asked to end, which leaves its rig safe.
async fn open_or_take(
    config: &RigConfig,
    ports: &Ports,
    wanted: DeviceSelection,
) -> Result<ManualRig, RigError> {
    let mut asked = false;
    let until = Instant::now() + LET_GO_WITHIN;
    loop {
        let error = match ManualRig::open(config, ports, wanted).await {
            Ok(device) => return Ok(device),
            Err(error) => error,
        };
        if !matches!(error.cause(), Cause::PortBusy) || Instant::now() >= until {
            return Err(error);
        }
        if !asked {
            asked = true;
            if !ask_to_end(&error.device().port) {
                return Err(error);
            }
        }
        tokio::time::sleep(TRY_AGAIN).await;
    }
}

/// Asks the fieldgap that holds a port to end safe; false where another program holds it, or nobody knows who.
fn ask_to_end(port: &str) -> bool {
    let Some(holder) = holder_of(port) else { return false };
    let this = std::env::current_exe().ok();
    let this = this.as_deref().and_then(std::path::Path::file_name);
    if this.is_none_or(|this| this.to_string_lossy() != holder.program) {
        println_quietly(&format!("{port} is held by {} (process {})", holder.program, holder.pid));
        return false;
    }
    println_quietly(&format!(
        "{port} is held by fieldgap, process {}: asking it to end",
        holder.pid
    ));
    Pid::from_raw(holder.pid).is_some_and(|pid| kill_process(pid, Signal::TERM).is_ok())
}

/// Says a line to whoever reads, who may have gone away: stopping must not end in a panic.
fn println_quietly(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stdout(), "{line}");
}
