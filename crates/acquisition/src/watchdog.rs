//! The watchdog process of a scan: it makes the rig safe, and then starts the failure hook.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::hook;
use fieldgap_records::{HookCommand, HookKind, Hooks};

/// Whom to notify of a program that was lost; the watchdog gets it at its start.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Notice {
    /// The program to start.
    hook: HookCommand,
    /// The folder of the record.
    scan: PathBuf,
}

impl Notice {
    /// The failure hook of a scan, if it has one.
    pub(super) fn of_failure(hooks: &Hooks, scan: &Path) -> Option<Self> {
        let hook = hooks.command(HookKind::Failure)?.clone();
        Some(Self { hook, scan: std::path::absolute(scan).unwrap_or_else(|_| scan.to_owned()) })
    }

    /// As a line of JSON.
    pub(super) fn encode(&self) -> String {
        serde_json::to_string(self).expect("paths and words are JSON")
    }
}

/// Guards as [`fieldgap_rig::watchdog::guard`] does. If the guarded program is lost, also starts the failure hook of its
/// scan, and adds its failure to the log.
///
/// # Errors
/// As that; or that the log could not be written.
pub fn guard(pipe: OwnedFd, answer: impl io::Write) -> io::Result<()> {
    let Some(mut acted) = fieldgap_rig::watchdog::guard(pipe, answer)? else { return Ok(()) };
    let logged = std::mem::replace(&mut acted.logged, Ok(()));
    let Some(note) = &acted.note else { return logged };
    let notice: Notice = serde_json::from_str(note)?;
    let message = acted.done.join("; ");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let Notice { hook, scan } = &notice;
    let ran = hook::run(hook, HookKind::Failure, scan, &message, hook::TIME_LIMIT);
    let said = match runtime.block_on(ran) {
        Ok(()) => format!("hook on_failure, `{}`: it was called", hook.program()),
        Err(fault) => format!("hook on_failure, `{}`: {fault}", hook.program()),
    };
    acted.log(&[said])?;
    logged
}
