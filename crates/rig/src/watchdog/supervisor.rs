//! The guarded program's side: it beats, and starts a guard again that is lost.

use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use rustix::io::{FdFlags, fcntl_setfd};
use tokio::sync::watch;

use super::activity::Activity;
use super::orders::Orders;
use super::pipe::{Heard, LinePipe};
use super::pulse::Pulse;
use super::{BEAT, BEAT_EVERY, BEAT_LOST_AFTER, Duties, GOODBYE, GUARDING, Standing};
use crate::emergency::Emergency;

/// How long a guard may take to be ready; a computer under load starts programs slowly.
const READY_WITHIN: Duration = Duration::from_secs(10);

/// Pause between attempts to start a guard.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// Keeps a guard.
pub(super) struct Supervisor {
    program: Command,
    orders: Orders,
    guard: Option<Guard>,
    pulse: Arc<Pulse>,
    standing: watch::Sender<Standing>,
    tried: Instant,
}

impl Supervisor {
    /// Starts the first guard. The thread that calls this is to beat.
    ///
    /// # Errors
    /// That it does not start or does not guard.
    pub fn begin(
        mut program: Command,
        duties: Duties,
        standing: watch::Sender<Standing>,
        pulse: Arc<Pulse>,
    ) -> io::Result<Self> {
        let orders = Orders::new(&duties);
        let emergencies = duties.emergencies;
        program.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let inherit = move || {
            // A session of its own: Ctrl-C, Ctrl-Z and a closed terminal are for the program alone, and the system does not
            // end a stopped guard with the program.
            rustix::process::setsid()?;
            let set = |one: &Emergency| fcntl_setfd(&one.spare, FdFlags::empty());
            emergencies.iter().try_for_each(set).map_err(io::Error::from)
        };
        // SAFETY: the closure makes system calls alone, which are allowed between fork and exec. Only the guard inherits the
        // handles that way, and no other program that is started meanwhile.
        unsafe { program.pre_exec(inherit) };
        let guard = Guard::start(&mut program, &orders)?;
        let tried = Instant::now();
        Ok(Self { program, orders, guard: Some(guard), pulse, standing, tried })
    }

    /// Beats until it is told to end or the teller is gone; the guard, if there is one then.
    pub fn until(mut self, ended: &Receiver<()>) -> Option<Guard> {
        loop {
            self.beat();
            if ended.recv_timeout(BEAT_EVERY) != Err(RecvTimeoutError::Timeout) {
                return self.guard;
            }
        }
    }

    fn beat(&mut self) {
        let unresponsive = self.pulse.unresponsive_for();
        let beat = |guard: &mut Guard| guard.beat(unresponsive);
        if let Some(Err(reason)) = self.guard.as_mut().map(beat) {
            // A log that cannot be written, as on a blocked terminal, must not stop the beat.
            let text = format!("the watchdog {reason}; another is started");
            std::thread::spawn(move || tracing::warn!("{text}"));
            if let Some(guard) = self.guard.take() {
                guard.end();
            }
            self.standing.send_modify(|standing| {
                standing.losses += 1;
                standing.reason = reason;
                standing.unguarded = true;
            });
        }
        if self.guard.is_some() || (self.tried.elapsed() < AGAIN_AFTER) {
            return;
        }
        self.tried = Instant::now();
        match Guard::start(&mut self.program, &self.orders) {
            Ok(guard) => {
                self.guard = Some(guard);
                self.standing.send_modify(|standing| standing.unguarded = false);
            }
            Err(error) => self.standing.send_modify(|standing| {
                standing.reason = format!("cannot be started again: {error}");
            }),
        }
    }
}

/// A running guard, and the pipe to it.
#[derive(Debug)]
pub(super) struct Guard {
    process: Child,
    pipe: Option<ChildStdin>,
    stopped_since: Option<Instant>,
}

impl Guard {
    /// Starts it and waits until it guards.
    fn start(program: &mut Command, orders: &Orders) -> io::Result<Self> {
        let mut process = program.spawn()?;
        let pipe = process.stdin.take();
        let answer = process.stdout.take().expect("it is piped");
        let mut guard = Self { process, pipe, stopped_since: None };
        let ready = guard.say(&orders.encode()).and_then(|()| guards(answer.into()));
        match ready {
            Ok(()) => Ok(guard),
            Err(error) => {
                guard.end();
                Err(error)
            }
        }
    }

    /// Sends a beat.
    ///
    /// # Errors
    /// Why the guard is lost.
    fn beat(&mut self, unresponsive: Duration) -> Result<(), String> {
        if let Ok(Some(status)) = self.process.try_wait() {
            return Err(format!("has ended ({status})"));
        }
        let id = self.process.id();
        let stopped = Activity::of(id, id as i32) == Activity::Stopped;
        let since = if stopped { self.stopped_since.or(Some(Instant::now())) } else { None };
        self.stopped_since = since;
        if since.is_some_and(|since| since.elapsed() >= BEAT_LOST_AFTER) {
            return Err(format!("was stopped for {} s", BEAT_LOST_AFTER.as_secs()));
        }
        self.say(&format!("{BEAT} {}", unresponsive.as_millis()))
            .map_err(|error| format!("does not listen ({error})"))
    }

    fn say(&mut self, line: &str) -> io::Result<()> {
        match &mut self.pipe {
            Some(pipe) => pipe.write_all(format!("{line}\n").as_bytes()),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    /// Says goodbye. If the guard has ended, there is nobody to say it to.
    pub fn say_goodbye(&mut self) {
        let _ = self.say(GOODBYE);
    }

    /// Closes the pipe; without a goodbye before, the guard acts.
    pub fn close(&mut self) {
        self.pipe = None;
    }

    /// Ends it at once; nobody guards then.
    fn end(mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }

    /// Whether it has not ended.
    pub fn runs(&mut self) -> bool {
        matches!(self.process.try_wait(), Ok(None))
    }
}

/// Waits until the guard says that it guards.
fn guards(answer: OwnedFd) -> io::Result<()> {
    let other = match LinePipe::new(answer).next_within(READY_WITHIN)? {
        Heard::Line(line) if line == GUARDING => return Ok(()),
        Heard::Line(line) => format!("it said `{line}`"),
        Heard::Quiet => format!("it did not guard within {} s", READY_WITHIN.as_secs()),
        Heard::Closed => "it ended at once".to_owned(),
    };
    Err(io::Error::other(other))
}
