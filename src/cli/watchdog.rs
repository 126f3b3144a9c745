//! `fieldgap watchdog`: the second process of a program that has a rig open, started by that program.

use std::process::{Command, ExitCode};

use clap::Args;
use miette::IntoDiagnostic;

use fieldgap_rig::watchdog::{self, guard};
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

/// Starts a watchdog for an open array. A virtual rig of this process ends with it and needs none.
pub(super) fn guard_array(
    array: &dyn FocusArray,
    is_virtual: bool,
) -> miette::Result<Option<watchdog::Watchdog>> {
    guard_devices(&array.emergency().into_iter().collect::<Vec<_>>(), is_virtual)
}

/// As [`guard_array`], for several devices.
pub(super) fn guard_devices(
    emergencies: &[Emergency],
    is_virtual: bool,
) -> miette::Result<Option<watchdog::Watchdog>> {
    if is_virtual {
        return Ok(None);
    }
    watchdog::Watchdog::start(watchdog()?, emergencies, None).into_diagnostic()
}

impl Watchdog {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        guard(std::io::stdin()).into_diagnostic()?;
        Ok(ExitCode::SUCCESS)
    }
}
