//! `fieldgap watchdog`: the second process of a program that has a rig open, started by that program.

use std::os::fd::AsFd;
use std::process::{Command, ExitCode};

use clap::Args;
use miette::IntoDiagnostic;

use fieldgap_acquisition::RigSetup;
use fieldgap_acquisition::watchdog::guard;
use fieldgap_rig::watchdog;
use fieldgap_rig::{Emergency, FocusArray};

/// The `watchdog` command.
#[derive(Debug, Args)]
pub(super) struct Watchdog {}

/// This program as a watchdog.
pub(super) fn watchdog() -> miette::Result<Command> {
    let mut program = Command::new(std::env::current_exe().into_diagnostic()?);
    program.arg("watchdog");
    Ok(program)
}

/// Starts a watchdog for an open array. The virtual devices of this process end with it and need none.
pub(super) fn guard_array(
    array: &dyn FocusArray,
    rig_setup: &RigSetup,
) -> miette::Result<Option<watchdog::Watchdog>> {
    guard_devices(array.emergency().into_iter().collect(), rig_setup)
}

/// As [`guard_array`], for several devices.
pub(super) fn guard_devices(
    emergencies: Vec<Emergency>,
    rig_setup: &RigSetup,
) -> miette::Result<Option<watchdog::Watchdog>> {
    let is_real = |one: &Emergency| rig_setup.real_devices().contains(&one.device.role);
    let emergencies = emergencies.into_iter().filter(is_real).collect();
    let duties = watchdog::Duties { emergencies, ..watchdog::Duties::default() };
    watchdog::Watchdog::start(watchdog()?, duties).into_diagnostic()
}

/// Does `work`, and shows the watchdog, where there is one, that it responds.
pub(super) async fn followed<T>(
    watchdog: Option<&watchdog::Watchdog>,
    work: impl Future<Output = T>,
) -> T {
    match watchdog {
        Some(watchdog) => watchdog.follower().follow(work).await,
        None => work.await,
    }
}

impl Watchdog {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let pipe = std::io::stdin().as_fd().try_clone_to_owned().into_diagnostic()?;
        guard(pipe, std::io::stdout()).into_diagnostic()?;
        Ok(ExitCode::SUCCESS)
    }
}
