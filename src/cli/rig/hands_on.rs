//! Devices in a person's hands: opened, used, and left safe however that ends.

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use miette::{IntoDiagnostic, miette};

use crate::cli::stop::StopRequests;
use crate::cli::watchdog::guard_devices;
use crate::rig_file::RigFile;
use fieldgap_acquisition::{AcquisitionError, RigSetup};
use fieldgap_rig::{DeviceSelection, ManualRig};
use fieldgap_virtual_rig::VirtualRig;

/// Whether stopping a command is how it is meant to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MeantToBeStopped(bool);

/// A command that has something to do: stopped, it has not done it.
pub(super) const A_TASK: MeantToBeStopped = MeantToBeStopped(false);

/// A command that goes on until it is stopped.
pub(super) const UNTIL_STOPPED: MeantToBeStopped = MeantToBeStopped(true);

/// How a command by hand ended.
pub(super) enum Ended {
    /// By itself; the robot stands and the array is as the command left it.
    Done,
    /// By the person who watches it, which is how it is meant to end; the devices are to be left safe.
    Enough,
}

/// Opens the devices and lends them to `body`. Where `body` fails or somebody asks to stop, the array is silenced, the
/// robot stopped, and what was done is said.
pub(super) fn hands_on(
    rig_file: &RigFile,
    wanted: DeviceSelection,
    MeantToBeStopped(meant): MeantToBeStopped,
    body: impl AsyncFnOnce(&mut ManualRig) -> miette::Result<Ended>,
) -> miette::Result<ExitCode> {
    let rig_setup = &rig_file.setup;
    let firmware = rig_file.open_virtual()?;
    let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    runtime.block_on(async {
        let stop = StopRequests::listen().into_diagnostic()?;
        let mut rig = ManualRig::open(&rig_setup.rig, &ports, wanted).await?;
        fits(rig_setup, wanted, &mut rig)?;
        let _watchdog = guard_devices(&rig.emergencies(), firmware.is_some())?;
        let ended = tokio::select! {
            biased;
            who = stop.first() => Err(who),
            ended = body(&mut rig) => Ok(ended),
        };
        match ended {
            Ok(Ok(Ended::Done)) => Ok(ExitCode::SUCCESS),
            Ok(Ok(Ended::Enough)) => {
                let made = rig.make_safe("ended").await;
                eprintln!("{made}");
                Ok(if made.is_safe() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
            }
            Ok(Err(failed)) => {
                eprintln!("{}", rig.make_safe("it failed").await);
                Err(failed)
            }
            Err(who) => {
                let made = rig.make_safe(who).await;
                eprintln!("{made}");
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

/// Tells that the robot homes first, and asks whether it may where somebody is there to answer.
///
/// # Errors
/// That the answer is no.
pub(super) fn may_home(yes: bool) -> miette::Result<()> {
    const WHY: &str = "The robot homes first: where it is cannot be known after its port was opened. The way of homing is its \
firmware's own; no keep-out box is checked on it.";
    if yes || !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
        eprintln!("{WHY}");
        return Ok(());
    }
    eprint!("{WHY}\nIs the way free? [y/N] ");
    std::io::stderr().flush().into_diagnostic()?;
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).into_diagnostic()?;
    if matches!(answer.trim().to_ascii_lowercase().as_str(), "y" | "yes") {
        Ok(())
    } else {
        Err(miette!(help = "answer y, or say --yes, when its way is free", "nothing was moved"))
    }
}
