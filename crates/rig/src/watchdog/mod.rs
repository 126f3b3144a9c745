//! A second process that makes the rig safe when the first one dies.
//!
//! A program that is killed cannot silence the array. So a small second process, the guard, holds a spare handle of the
//! array's and the robot's port, and receives a beat through a pipe. Once the program is lost, the guard sends each device its
//! [`Emergency`] bytes, ends the program if it still exists (what it would go on to record is no longer true), and writes what
//! it did to a log.
//!
//! # When the program is lost
//!
//! | what the guard sees | it acts after |
//! |---|---|
//! | the pipe is closed without a goodbye: the program was killed or crashed | at once |
//! | no beat, and the program is stopped (SIGSTOP, Ctrl-Z, a debugger) | [`BEAT_LOST_AFTER`], 2 s |
//! | no beat, and the thread that beats sleeps, although its time is up | [`BEAT_LOST_AFTER`] and three looks, 2.3 s |
//! | no beat, but the thread that beats waits for a processor, memory or the disk: the computer is slow | [`SLOW_AT_MOST`], 30 s |
//! | beats, but the work itself has not responded: it is deadlocked or busy | [`SLOW_AT_MOST`], 30 s |
//!
//! The guard counts its own waits: one that took longer than asked counts for at most twice its time, because then the guard
//! itself was held up. The state of the thread comes from `/proc`. Time in which the computer is suspended does not count. All
//! times hold for a guard that gets processor time.
//!
//! # When the guard is lost
//!
//! The program notices within a beat that its guard has ended, and within [`BEAT_LOST_AFTER`] that it is stopped. It starts
//! another at once, and then once a second. [`Watchdog::standing`] tells.

mod activity;
mod guard;
mod orders;
mod pipe;
mod pulse;
mod release;
mod supervisor;
mod vigil;

use std::io;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::sync::watch;

pub use guard::{Acted, guard};
pub use pulse::Follower;
use pulse::Pulse;
pub(crate) use release::once_released;
use supervisor::{Guard, Supervisor};

use super::emergency::Emergency;

/// How often the guarded program sends a beat.
const BEAT_EVERY: Duration = Duration::from_millis(250);

/// Time without a beat after which the guard looks at what the program does.
pub const BEAT_LOST_AFTER: Duration = Duration::from_secs(2);

/// Longest time for which a program without a beat, or without a response of its work, passes for slow.
pub const SLOW_AT_MOST: Duration = Duration::from_secs(30);

/// How long the guard may take to go after a goodbye.
const GONE_WITHIN: Duration = Duration::from_secs(2);

const BEAT: &str = "beat";
const GOODBYE: &str = "goodbye";
const GUARDING: &str = "guarding";

/// What a guard needs to know.
#[derive(Debug, Default)]
pub struct Duties {
    /// What makes the devices safe.
    pub emergencies: Vec<Emergency>,
    /// Where the guard writes what it did; it writes only if it had to act.
    pub log: Option<PathBuf>,
    /// A text that [`guard()`] returns if it had to act, for whoever called it.
    pub note: Option<String>,
}

/// Whether the guard is there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Standing {
    /// How many guards were lost so far.
    pub losses: u32,
    /// Why the last one was lost, for a person.
    pub reason: String,
    /// Whether none guards now.
    pub unguarded: bool,
}

/// The guard of a rig that this program has open. Dropping it says goodbye, unless the thread is panicking: then the guard
/// acts.
#[derive(Debug)]
pub struct Watchdog {
    end: Option<Sender<()>>,
    supervising: Option<JoinHandle<Option<Guard>>>,
    standing: watch::Receiver<Standing>,
    pulse: Arc<Pulse>,
}

impl Watchdog {
    /// Starts `program`, which calls [`guard()`], and waits until it guards; `None` where there is nothing to do for it.
    ///
    /// # Errors
    /// That the program cannot be started, or does not guard.
    pub fn start(program: Command, duties: Duties) -> io::Result<Option<Self>> {
        if duties.emergencies.is_empty() && duties.note.is_none() {
            return Ok(None);
        }
        let pulse = Arc::new(Pulse::default());
        let (standing, stands) = watch::channel(Standing::default());
        let (end, ended) = channel();
        let (tell, told) = channel();
        let of_thread = Arc::clone(&pulse);
        let work = move || match Supervisor::begin(program, duties, standing, of_thread) {
            Ok(supervisor) => {
                let _ = tell.send(Ok(()));
                supervisor.until(&ended)
            }
            Err(error) => {
                let _ = tell.send(Err(error));
                None
            }
        };
        let supervising =
            std::thread::Builder::new().name("watchdog-beat".to_owned()).spawn(work)?;
        told.recv().unwrap_or_else(|_| Err(io::Error::other("its thread ended")))?;
        Ok(Some(Self { end: Some(end), supervising: Some(supervising), standing: stands, pulse }))
    }

    /// Tells whether the guard is there, and of each loss.
    pub fn standing(&self) -> watch::Receiver<Standing> {
        self.standing.clone()
    }

    /// Shows the guard that work responds.
    pub fn follower(&self) -> Follower {
        Follower::new(Arc::clone(&self.pulse))
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        drop(self.end.take());
        let guard = self.supervising.take().and_then(|thread| thread.join().ok()).flatten();
        let Some(mut guard) = guard else { return };
        if !std::thread::panicking() {
            guard.say_goodbye();
        }
        guard.close();
        let until = Instant::now() + GONE_WITHIN;
        while guard.runs() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}
