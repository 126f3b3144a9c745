//! `fieldgap serve`: the rig in a browser.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::output::{print, say};
use super::stop::StopRequests;
use super::watchdog::guard_devices;
use crate::rig_file::RigFile;
use fieldgap_rig::{DeviceSelection, ManualRig};
use fieldgap_serve::{Bench, CameraAddress, HandRig, Opening, Role, Server};
use fieldgap_virtual_rig::VirtualRig;

/// The `serve` command.
#[derive(Debug, Args)]
pub(super) struct Serve {
    /// Rig file
    rig: PathBuf,
    /// Port on this computer; 0 takes any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8321)]
    port: u16,
    /// Folder of the plans
    #[arg(long, value_name = "DIR", default_value = "scans")]
    plans: PathBuf,
    /// Folder of the records, and of the audit log
    #[arg(long, value_name = "DIR", default_value = "out")]
    records: PathBuf,
    /// Page or MJPEG stream of a camera beside the rig, shown in the view of the rig
    #[arg(long, value_name = "ADDRESS")]
    camera: Option<CameraAddress>,
}

impl Serve {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.rig)?;
        rig_file.check_truth()?;
        let path = self.rig.clone();
        let bench = Bench {
            setup: rig_file.setup,
            rig: self.rig,
            plans: self.plans,
            records: self.records,
            camera: self.camera,
            program: std::env::current_exe().into_diagnostic()?,
            open: Box::new(move || opening(path.clone())),
        };
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let scan_goes_on = runtime.block_on(async {
            let stop = StopRequests::listen().into_diagnostic()?;
            let server = Server::bind(bench, self.port).await.map_err(|error| {
                let help = error.remedy();
                miette!(help = help, "{error}")
            })?;
            print(&format!("{}\n", server.link("desk", Role::Admin)))?;
            say("open this address in a browser on this computer; it logs in once, within 15 minutes. Ctrl-C ends the server.");
            Ok::<_, miette::Report>(server.run(async { let _ = stop.first().await; }).await)
        })?;
        // A browser that stays connected must not keep the program.
        runtime.shutdown_background();
        if scan_goes_on {
            say("the scan goes on without the server; `fieldgap rig stop` stops it");
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Opening a device borrows across waits in a way that a task cannot be moved with; a thread that waits for it can.
fn opening(path: PathBuf) -> Opening {
    Box::pin(async move {
        let runtime = tokio::runtime::Handle::current();
        let opened = tokio::task::spawn_blocking(move || runtime.block_on(open_by_hand(path)));
        opened.await.map_err(|error| error.to_string())?
    })
}

/// Opens array, robot and receiver of a rig file, guarded by a watchdog where they are real.
async fn open_by_hand(path: PathBuf) -> Result<HandRig, String> {
    let in_words = |error: &dyn std::fmt::Display| error.to_string();
    let rig_file = RigFile::read(&path).map_err(|error| in_words(&error))?.on_wall_clock();
    let firmware = rig_file.open_virtual().map_err(|error| in_words(&error))?;
    let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
    let wanted = DeviceSelection { robot: true, array: true, receiver: true };
    let setup = &rig_file.setup;
    let mut rig = ManualRig::open(&setup.rig, &ports, wanted)
        .await
        .map_err(|error| format!("{error}. {}", error.remedy()))?;
    if let Some(shadow) = firmware.as_ref().and_then(VirtualRig::robot_shadow) {
        rig = rig.observed_by(Box::new(shadow));
    }
    let (believed, controller) = (setup.nominal_array().len(), rig.array().identity().elements);
    if believed != controller {
        return Err(format!(
            "the rig file has an array of {believed} elements, and the controller drives {controller}"
        ));
    }
    let watchdog = guard_devices(rig.emergencies(), setup).map_err(|error| in_words(&error))?;
    Ok(HandRig { rig, watchdog, keeps: Box::new(firmware) })
}
