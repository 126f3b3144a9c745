//! Operating devices by hand: they are opened, used, and made safe at every kind of end.

use std::process::ExitCode;

use miette::IntoDiagnostic;

use crate::cli::output::say;
use crate::cli::stop::StopRequests;
use crate::cli::watchdog::{followed, guard_devices};
use crate::rig_file::RigFile;
use fieldgap_acquisition::{AcquisitionError, RigSetup};
use fieldgap_rig::{DeviceSelection, ManualRig};
use fieldgap_virtual_rig::VirtualRig;

/// Whether stopping a command is its normal end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StopIsNormal(bool);

/// A command with a task: if stopped, it has failed.
pub(super) const A_TASK: StopIsNormal = StopIsNormal(false);

/// A command that runs until it is stopped.
pub(super) const UNTIL_STOPPED: StopIsNormal = StopIsNormal(true);

/// How a command ended.
pub(super) enum Ended {
    /// By itself; robot and array stay as the command left them.
    Done,
    /// On request of the user; the devices must be made safe.
    Enough,
}

/// Opens the devices and runs `body` with them. If `body` fails or a stop is requested, the array is silenced and the
/// robot stopped, and that is reported.
pub(super) fn hands_on(
    rig_file: &RigFile,
    wanted: DeviceSelection,
    StopIsNormal(meant): StopIsNormal,
    body: impl AsyncFnOnce(&mut ManualRig) -> miette::Result<Ended>,
) -> miette::Result<ExitCode> {
    let rig_setup = &rig_file.setup;
    let firmware = rig_file.open_virtual()?;
    let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    runtime.block_on(async {
        let stop = StopRequests::listen().into_diagnostic()?;
        let mut rig = ManualRig::open(&rig_setup.rig, &ports, wanted).await?;
        if let Some(shadow) = firmware.as_ref().and_then(VirtualRig::robot_shadow) {
            rig = rig.observed_by(Box::new(shadow));
        }
        fits(rig_setup, wanted, &mut rig)?;
        let watchdog = guard_devices(rig.emergencies(), rig_setup)?;
        let ended = tokio::select! {
            biased;
            who = stop.first() => Err(who),
            ended = followed(watchdog.as_ref(), body(&mut rig)) => Ok(ended),
        };
        match ended {
            Ok(Ok(Ended::Done)) => Ok(ExitCode::SUCCESS),
            Ok(Ok(Ended::Enough)) => {
                let made = rig.make_safe("ended").await;
                say(&made);
                Ok(if made.is_safe() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
            }
            Ok(Err(failed)) => {
                say(rig.make_safe("it failed").await);
                Err(failed)
            }
            Err(who) => {
                let made = rig.make_safe(who).await;
                say(&made);
                Ok(if meant && made.is_safe() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
            }
        }
    })
}

fn fits(rig_setup: &RigSetup, wanted: DeviceSelection, rig: &mut ManualRig) -> miette::Result<()> {
    if !wanted.array {
        return Ok(());
    }
    let (believed, controller) = (rig_setup.nominal_array().len(), rig.array().identity().elements);
    if believed == controller {
        Ok(())
    } else {
        Err(AcquisitionError::OtherArray { believed, controller }.into())
    }
}
