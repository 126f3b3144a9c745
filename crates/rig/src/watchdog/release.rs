//! Ports that the guard of a program that was killed still holds.

use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tokio::time::{Instant, sleep};

use super::activity::parent_of;
use super::guard::ACTS_WITHIN;
use crate::error::{Cause, RigError};

/// How long such a port is waited for: as long as the guard takes at most, and some time for a computer under load.
const RELEASED_WITHIN: Duration = ACTS_WITHIN.saturating_add(Duration::from_secs(5));

/// How often the port is tried.
const TRIED_EVERY: Duration = Duration::from_millis(50);

/// Opens a device. If the watchdog of a program that was killed still holds its port, waits for that, which is logged as a warning.
///
/// # Errors
/// The device's; [`Cause::PortBusy`] if another program holds the port, or the watchdog for too long.
pub(crate) async fn once_released<T>(
    mut open: impl AsyncFnMut() -> Result<T, RigError>,
) -> Result<T, RigError> {
    let until = Instant::now() + RELEASED_WITHIN;
    let mut told = false;
    let mut tried_since_free = false;
    loop {
        let error = match open().await {
            Err(error) if matches!(error.cause(), Cause::PortBusy) => error,
            other => return other,
        };
        let port = &error.device().port;
        if Instant::now() >= until {
            return Err(error);
        }
        if !left_by_a_guarded_program(port) {
            if tried_since_free {
                return Err(error);
            }
            // The watchdog may have let go between the attempt and this look.
            tried_since_free = true;
            continue;
        }
        tried_since_free = false;
        if !told {
            told = true;
            tracing::warn!(
                "the watchdog of a program that was killed still makes {port} safe: waiting for it, for {} s at most",
                RELEASED_WITHIN.as_secs()
            );
        }
        sleep(TRIED_EVERY).await;
    }
}

/// Whether a watchdog holds a port whose program has ended. Known on Linux only.
fn left_by_a_guarded_program(port: &str) -> bool {
    let Ok(port) = fs::canonicalize(port) else { return false };
    let Ok(processes) = fs::read_dir("/proc") else { return false };
    processes.filter_map(Result::ok).any(|process| {
        let folder = process.path();
        let number = process.file_name().to_str().and_then(|name| name.parse::<u32>().ok());
        number.is_some_and(|number| {
            is_watchdog(&folder) && holds(&folder, &port) && !is_guarding(number, &folder)
        })
    })
}

/// Whether a process is this program as a watchdog.
fn is_watchdog(process: &Path) -> bool {
    let words = fs::read(process.join("cmdline")).unwrap_or_default();
    let mut words = words.split(|&byte| byte == 0).skip(1);
    words.next() == Some(b"watchdog") && program_of(process).is_some_and(|name| is_this(&name))
}

fn is_this(program: &Path) -> bool {
    std::env::current_exe().is_ok_and(|this| this.file_name() == program.file_name())
}

fn program_of(process: &Path) -> Option<PathBuf> {
    let exe = fs::read_link(process.join("exe")).ok()?;
    // A program whose file was replaced since is shown as `fieldgap (deleted)`.
    let name = exe.as_os_str().as_bytes();
    let name = name.strip_suffix(b" (deleted)").unwrap_or(name);
    Some(PathBuf::from(std::ffi::OsStr::from_bytes(name)))
}

fn holds(process: &Path, port: &Path) -> bool {
    let Ok(handles) = fs::read_dir(process.join("fd")) else { return false };
    handles
        .filter_map(Result::ok)
        .any(|handle| fs::read_link(handle.path()).is_ok_and(|to| to == port))
}

/// Whether the program that a watchdog guards still exists: it is its parent.
fn is_guarding(watchdog: u32, process: &Path) -> bool {
    let parent = parent_of(watchdog).map(|parent| process.with_file_name(parent.to_string()));
    parent.and_then(|parent| program_of(&parent)).is_some_and(|program| is_this(&program))
}
