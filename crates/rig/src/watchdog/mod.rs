//! A second process that makes the rig safe when the first one dies.
//!
//! A program that is killed cannot silence the array. So a small second process guards the rig. It holds a spare handle
//! of the array's and the robot's port, and receives a beat through a pipe. Where the pipe closes or the beat stops for [`BEAT_LOST_AFTER`], and no goodbye came, it sends each device its [`Emergency`] bytes,
//! ends the program if that merely stands still (what it would go on to record is no longer true), and writes what it
//! did to a log.

mod guard;
mod orders;

use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::io::{FdFlags, fcntl_setfd};

pub use guard::guard;
use orders::Orders;

use super::emergency::Emergency;

/// How often the guarded program sends a beat.
const BEAT_EVERY: Duration = Duration::from_millis(250);

/// Time without a beat after which the program is taken for hung.
pub const BEAT_LOST_AFTER: Duration = Duration::from_secs(2);

/// How long the guard may take to go after a goodbye.
const GONE_WITHIN: Duration = Duration::from_secs(2);

const BEAT: &str = "beat";
const GOODBYE: &str = "goodbye";

/// The guard of a rig that this program has open. Dropping it says goodbye, unless the thread is panicking: then the guard
/// acts.
#[derive(Debug)]
pub struct Watchdog {
    guard: Child,
    end: Option<Sender<()>>,
    beating: Option<JoinHandle<Option<ChildStdin>>>,
}

impl Watchdog {
    /// Starts `program`, which calls [`guard()`], for the devices that have an emergency command; `None` where none has.
    /// What the guard does is written to `log`, where there is one.
    ///
    /// # Errors
    /// That the program cannot be started.
    pub fn start(
        mut program: Command,
        emergencies: &[Emergency],
        log: Option<&Path>,
    ) -> io::Result<Option<Self>> {
        if emergencies.is_empty() {
            return Ok(None);
        }
        let orders = Orders::new(emergencies, log);
        let inherited = |flags| {
            let set = |emergency: &Emergency| fcntl_setfd(&emergency.spare, flags);
            emergencies.iter().try_for_each(set)
        };
        // A group of its own: Ctrl-C and Ctrl-Z in the terminal are for the program alone.
        program.process_group(0).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        inherited(FdFlags::empty())?;
        let started = program.spawn();
        inherited(FdFlags::CLOEXEC)?;
        let mut guard = started?;
        let mut pipe = guard.stdin.take().expect("it is piped");
        writeln!(pipe, "{}", orders.encode())?;
        let (end, ended) = channel();
        let beating =
            std::thread::Builder::new().name("watchdog-beat".to_owned()).spawn(move || {
                while writeln!(pipe, "{BEAT}").is_ok() {
                    if ended.recv_timeout(BEAT_EVERY) != Err(RecvTimeoutError::Timeout) {
                        return Some(pipe);
                    }
                }
                tracing::error!(
                    "the watchdog process has ended: nothing would silence the array if this program were killed"
                );
                None
            })?;
        Ok(Some(Self { guard, end: Some(end), beating: Some(beating) }))
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        drop(self.end.take());
        let pipe = self.beating.take().and_then(|beating| beating.join().ok()).flatten();
        if let Some(mut pipe) = pipe
            && !std::thread::panicking()
        {
            // If the guard has ended, there is nobody to say goodbye to.
            let _ = writeln!(pipe, "{GOODBYE}");
        }
        let until = Instant::now() + GONE_WITHIN;
        while matches!(self.guard.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}
