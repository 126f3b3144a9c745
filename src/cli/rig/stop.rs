//! `fieldgap rig stop`: silence the array and stop the robot, even if another process uses them.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use miette::IntoDiagnostic;
use rustix::process::{Pid, Signal, kill_process};
use tokio::time::Instant;

use super::RigArg;
use crate::cli::output::print;
use crate::rig_file::RigFile;
use fieldgap_rig::link::holder_of;
use fieldgap_rig::{Cause, DeviceSelection, ManualRig, Ports, RigConfig, RigError};
use fieldgap_virtual_rig::VirtualRig;

/// Time limit for another fieldgap process to end safely and release its ports.
const RELEASE_TIME_LIMIT: Duration = Duration::from_secs(5);

/// Interval at which a port is tried meanwhile.
const RETRY_INTERVAL: Duration = Duration::from_millis(50);

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
                        print_line(&made.to_string());
                    }
                    Err(error) => {
                        safe = false;
                        let may = if wanted.array {
                            "THE ARRAY MAY STILL EMIT"
                        } else {
                            "THE ROBOT MAY STILL MOVE"
                        };
                        print_line(&format!("{may}: {error}\n  {}", error.remedy()));
                    }
                }
            }
            safe
        });
        if safe {
            print_line("the robot's position is now unknown; it must home before its next move");
            Ok(ExitCode::SUCCESS)
        } else {
            print_line("switch off the power of the devices");
            Ok(ExitCode::FAILURE)
        }
    }
}

/// Opens a device. If another fieldgap process holds its port, that process is asked to end, which leaves its rig safe.
async fn open_or_take(
    config: &RigConfig,
    ports: &Ports,
    wanted: DeviceSelection,
) -> Result<ManualRig, RigError> {
    let mut asked = false;
    let until = Instant::now() + RELEASE_TIME_LIMIT;
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
        tokio::time::sleep(RETRY_INTERVAL).await;
    }
}

/// Asks the fieldgap process that holds a port to end; false if another program or an unknown process holds it.
fn ask_to_end(port: &str) -> bool {
    let Some(holder) = holder_of(port) else { return false };
    let this = std::env::current_exe().ok();
    let this = this.as_deref().and_then(std::path::Path::file_name);
    if this.is_none_or(|this| this.to_string_lossy() != holder.program) {
        print_line(&format!("{port} is held by {} (process {})", holder.program, holder.pid));
        return false;
    }
    print_line(&format!("{port} is held by fieldgap, process {}: asking it to end", holder.pid));
    Pid::from_raw(holder.pid).is_some_and(|pid| kill_process(pid, Signal::TERM).is_ok())
}

/// Prints a line and ignores errors: stopping must not end because the reader has gone.
fn print_line(line: &str) {
    let _ = print(&format!("{line}\n"));
}
