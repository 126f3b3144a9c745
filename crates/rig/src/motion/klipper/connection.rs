//! The conversation with the host software: one line at a time, each to its `ok`.
//!
//! An `ok` may be one too many, or be lost. Lines are answered in order, so behind an answered mark no earlier line is open. Every
//! command may be sent again: targets are absolute.

use std::time::Duration;

use tokio::time::Instant;

use super::reply::{MARK, Reply};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::motion::firmware::Firmware;
use crate::space::RobotPosition;

/// How long the host software may take to start, and its micro-controllers with it.
const READY_WITHIN: Duration = Duration::from_secs(30);

/// How often a host software that starts is asked again.
const ASK_AGAIN_AFTER: Duration = Duration::from_secs(1);

/// Silence after which a mark is sent: line or answer may be lost. It is answered behind the line, however long that takes.
const QUIET: Duration = Duration::from_secs(5);

/// How often a command whose answer was lost or damaged is repeated.
const MOST_REPEATS: u32 = 8;

/// Marks of one opening have numbers of their own, more than a session needs.
const MARKS: u64 = 1_000_000;

/// Stops whatever moves and shuts Klipper down; behind a line that may have been broken off.
pub(super) const SHUT_DOWN: &[u8] = b"\nM112\n";

/// What a line brought.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// What stood behind its `ok`.
    pub(super) behind_ok: String,
    /// Whether the command is not known.
    pub(super) unknown: bool,
    pub(super) position: Option<RobotPosition>,
}

/// The conversation with one host software.
#[derive(Debug)]
pub(super) struct Connection<L> {
    pub(super) wire: Wire<L>,
    /// False from the sending of a line until its `ok`, so a cancelled exchange leaves it false.
    in_step: bool,
    marks: u64,
}

impl<L: ByteLink> Connection<L> {
    pub(super) fn new(wire: Wire<L>) -> Self {
        Self { wire, in_step: false, marks: 0 }
    }

    /// Waits until the host software is ready.
    ///
    /// # Errors
    /// That nothing answers, that another firmware does, or that Klipper has shut down.
    pub(super) async fn begin(&mut self) -> Result<(), RigError> {
        let until = Instant::now() + READY_WITHIN;
        let mut not_ready = None;
        while Instant::now() < until {
            self.wire.send(b"\nSTATUS\n").await?;
            while let Some(line) =
                self.wire.line(until.min(Instant::now() + ASK_AGAIN_AFTER)).await?
            {
                match Reply::parse(&line) {
                    Reply::State(state) if state == "Ready" => {
                        return self.settle(READY_WITHIN).await;
                    }
                    Reply::State(state) if state == "Shutdown" => {
                        return Err(self.shutdown().await);
                    }
                    Reply::Error(reply) | Reply::State(reply) => not_ready = Some(reply),
                    _ if Firmware::of_line(&line)
                        .is_some_and(|firmware| firmware != Firmware::Klipper) =>
                    {
                        let cause = Cause::OtherFirmware { named: "Klipper", received: line };
                        return Err(self.wire.error(cause));
                    }
                    _ => {}
                }
            }
        }
        Err(self.wire.error(match not_ready {
            Some(reply) => Cause::Shutdown { reply },
            None => Cause::Silent { waited: READY_WITHIN },
        }))
    }

    /// Sends a line and reads to its `ok`; again where line or answer were lost.
    ///
    /// # Errors
    /// [`Cause::Refused`] where the command failed, [`Cause::Shutdown`] where Klipper did, or silence.
    pub(super) async fn command(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<Answer, RigError> {
        let until = Instant::now() + within;
        for _ in 0..MOST_REPEATS {
            if !self.in_step {
                self.settle(until.saturating_duration_since(Instant::now())).await?;
            }
            if let Some(answer) = self.exchange(command, until).await? {
                return Ok(answer);
            }
            if Instant::now() >= until {
                return Err(self.wire.error(Cause::Silent { waited: within }));
            }
        }
        Err(self.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    /// As [`Connection::command`], for one that every Klipper knows: where it is not known, or is refused for another reason
    /// than before, it was damaged on its way and is sent again.
    pub(super) async fn required(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<Answer, RigError> {
        let mut refused_before = None;
        for _ in 0..MOST_REPEATS {
            match self.command(command, within).await {
                Ok(answer) if !answer.unknown => return Ok(answer),
                Ok(_) => {}
                Err(error) => match error.cause() {
                    // Homing that failed is not tried again by itself: an axis may stand at its end.
                    Cause::Refused { reply }
                        if !command.starts_with("G28")
                            && refused_before.as_ref() != Some(reply) =>
                    {
                        refused_before = Some(reply.clone());
                    }
                    _ => return Err(error),
                },
            }
        }
        Err(self.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    /// Sends a line once. `None` where a mark sent behind it into the silence was answered and the line was not.
    async fn exchange(
        &mut self,
        command: &str,
        until: Instant,
    ) -> Result<Option<Answer>, RigError> {
        self.in_step = false;
        self.wire.send(format!("{command}\n").as_bytes()).await?;
        let mut answer = Answer::default();
        let mut failed = None;
        let mut shut_down = false;
        let mut mark = None;
        loop {
            let Some(line) = self.wire.line(until.min(Instant::now() + QUIET)).await? else {
                if Instant::now() >= until {
                    return Ok(None);
                }
                mark = Some(self.send_mark().await?);
                continue;
            };
            match Reply::parse(&line) {
                Reply::Ok(behind_ok) => {
                    // With a mark under way, more answers come.
                    self.in_step = mark.is_none();
                    return match failed {
                        Some(reply) if shut_down => Err(self.wire.error(Cause::Shutdown { reply })),
                        Some(reply) => Err(self.wire.error(Cause::Refused { reply })),
                        None if shut_down => Err(self.shutdown().await),
                        None => Ok(Some(Answer { behind_ok, ..answer })),
                    };
                }
                Reply::Error(reply) => {
                    failed.get_or_insert(reply);
                }
                Reply::State(state) if state == "Ready" => {
                    return Err(self.wire.error(Cause::Reset));
                }
                Reply::State(_) => shut_down = true,
                Reply::Unknown(command) if Some(&command) == mark.as_ref() => return Ok(None),
                Reply::Unknown(_) => answer.unknown = true,
                Reply::Position(position) => answer.position = Some(position),
                Reply::Other => {}
            }
        }
    }

    /// Shuts Klipper down, which stops all motion, and waits for its word.
    pub(super) async fn shut_down(&mut self, within: Duration) -> Result<(), RigError> {
        self.in_step = false;
        self.wire.send(SHUT_DOWN).await?;
        let until = Instant::now() + within;
        while let Some(line) = self.wire.line(until).await? {
            match Reply::parse(&line) {
                Reply::State(state) if state == "Shutdown" => return Ok(()),
                // Something before it had shut Klipper down already.
                Reply::Error(error) if error.to_ascii_lowercase().contains("shutdown") => {
                    return Ok(());
                }
                _ => {}
            }
        }
        Err(self.wire.error(Cause::Silent { waited: within }))
    }

    /// Restarts firmware and host software after a shutdown.
    pub(super) async fn restart(&mut self) -> Result<(), RigError> {
        self.in_step = false;
        self.wire.send(b"\nFIRMWARE_RESTART\n").await?;
        let until = Instant::now() + READY_WITHIN;
        while let Some(line) = self.wire.line(until).await? {
            if Reply::parse(&line) == Reply::State("Ready".to_owned()) {
                return self.settle(READY_WITHIN).await;
            }
        }
        Err(self.wire.error(Cause::Silent { waited: READY_WITHIN }))
    }

    /// Sends a command that nobody knows, which Klipper repeats.
    async fn send_mark(&mut self) -> Result<String, RigError> {
        self.marks += 1;
        // A command is letters and one number; Klipper takes what follows for its parameters.
        let mark = format!("{MARK}{}", u64::from(self.wire.opening()) * MARKS + self.marks);
        self.wire.send(format!("\n{mark}\n").as_bytes()).await?;
        Ok(mark)
    }

    /// Makes sure that all that was sent before was done, and that no answer to it is still on its way.
    pub(super) async fn settle(&mut self, within: Duration) -> Result<(), RigError> {
        self.in_step = false;
        let until = Instant::now() + within;
        while Instant::now() < until {
            let mark = self.send_mark().await?;
            let mut marked = false;
            while let Some(line) = self.wire.line(until.min(Instant::now() + QUIET)).await? {
                match Reply::parse(&line) {
                    Reply::Unknown(command) if command == mark => marked = true,
                    Reply::Ok(_) if marked => {
                        self.in_step = true;
                        return Ok(());
                    }
                    Reply::State(state) if state == "Shutdown" => {
                        return Err(self.shutdown().await);
                    }
                    // A host software that has shut down knows no command, and says so of each.
                    Reply::Error(reply) if reply.to_ascii_lowercase().contains("shutdown") => {
                        return Err(self.wire.error(Cause::Shutdown { reply }));
                    }
                    _ => {}
                }
            }
        }
        Err(self.wire.error(Cause::Silent { waited: within }))
    }

    /// That Klipper has shut down, with its reason.
    async fn shutdown(&mut self) -> RigError {
        match self.reason().await {
            Ok(reply) => self.wire.error(Cause::Shutdown { reply }),
            Err(error) => error,
        }
    }

    /// Why Klipper has shut down: a command that needs the motors is refused with the reason.
    async fn reason(&mut self) -> Result<String, RigError> {
        self.wire.send(b"\nM400\n").await?;
        let until = Instant::now() + ASK_AGAIN_AFTER;
        while let Some(line) = self.wire.line(until).await? {
            if let Reply::Error(reason) = Reply::parse(&line) {
                return Ok(reason);
            }
        }
        Ok("no reason given".to_owned())
    }
}
