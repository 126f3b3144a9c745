//! The conversation with one firmware: its beginning, one command after the other, the stop.
//!
//! Anything reported behind a mark was asked for behind it. So where anything was lost since the last mark, one is awaited
//! first, and only then the position is asked for: no late report is taken for the answer.

use std::time::Duration;

use tokio::time::Instant;

use super::exchange::{Answer, Proof, QUIET, exchange};
use super::line::numbered;
use super::numbered_line::NumberedLine;
use super::reply::Reply;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::motion::firmware::Firmware;
use crate::space::RobotPosition;

/// How long a firmware may take to start: boot loader, then banner, then settings.
const START_WITHIN: Duration = Duration::from_secs(20);

/// Silence during the start after which the opening line is sent again.
const START_QUIET: Duration = Duration::from_secs(1);

/// How long the answer to a stop may take before the stop is sent once more. Marlin answers after it has discarded its queue
/// for a second, without the emergency parser for two; another `M410` begins that time anew.
const STOP_AGAIN_AFTER: Duration = Duration::from_millis(2500);

/// The numbered conversation with one firmware.
#[derive(Debug)]
pub(super) struct Connection<L> {
    pub(super) line: NumberedLine<L>,
    /// False from the start of an exchange until its good end, so a cancelled one leaves it false.
    in_step: bool,
    /// Whether something was lost or cut short since the last mark came, so that answers to it may still come.
    in_doubt: bool,
}

impl<L: ByteLink> Connection<L> {
    pub(super) fn new(wire: Wire<L>) -> Self {
        Self { line: NumberedLine::new(wire), in_step: false, in_doubt: true }
    }

    /// Whether firmware and program agree on the line numbers, so that a command can be sent.
    pub(super) fn in_step(&self) -> bool {
        self.in_step
    }

    /// Agrees on line numbers with a firmware that may just be starting.
    pub(super) async fn begin(&mut self) -> Result<(), RigError> {
        let until = Instant::now() + START_WITHIN;
        while Instant::now() < until {
            self.in_step = false;
            self.in_doubt = true;
            self.line.restart();
            if !self.opened(until).await? {
                continue;
            }
            // Several openings may have been answered; the mark settles every `ok` of theirs.
            match self.position(START_WITHIN).await {
                // The opening was damaged on its way, or the board has only now started. Nothing moves yet.
                Err(error) if matches!(error.cause(), Cause::LineNotKept { .. } | Cause::Reset) => {
                }
                position => return position.map(drop),
            }
        }
        Err(self.line.silent(START_WITHIN))
    }

    /// Sends the opening line; whether it was acknowledged.
    async fn opened(&mut self, until: Instant) -> Result<bool, RigError> {
        let opening = numbered(0, "M110 N0").map_err(|cause| self.line.wire.error(cause))?;
        self.line.wire.send(opening.as_bytes()).await?;
        let mut damaged = false;
        while let Some(line) = self.line.wire.line(until.min(Instant::now() + START_QUIET)).await? {
            if Firmware::of_line(&line).is_some_and(|firmware| firmware != Firmware::Marlin) {
                let cause = Cause::OtherFirmware { named: "Marlin", received: line };
                return Err(self.line.wire.error(cause));
            }
            match Reply::parse(&line) {
                // The `ok` behind a complaint acknowledges nothing.
                Reply::Ok { .. } if std::mem::take(&mut damaged) => return Ok(false),
                Reply::Ok { .. } => {
                    self.line.halted = None;
                    return Ok(true);
                }
                Reply::Resend(_) | Reply::TransmissionError | Reply::UnknownCommand => {
                    damaged = true
                }
                Reply::Halted => return Err(self.line.halted(line)),
                _ => {}
            }
        }
        Ok(false)
    }

    /// Sends a command and waits until the firmware has taken it.
    pub(super) async fn command(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<Answer, RigError> {
        self.exchange(command, Proof::Ok, within).await
    }

    /// As [`Connection::command`], for one that every build must know.
    pub(super) async fn required(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<(), RigError> {
        match self.command(command, within).await?.unknown {
            None => Ok(()),
            Some(reply) => Err(self.line.wire.error(Cause::Refused { reply })),
        }
    }

    /// Asks where the robot is. Everything sent before has been executed when this returns.
    pub(super) async fn position(&mut self, within: Duration) -> Result<RobotPosition, RigError> {
        if self.in_doubt {
            self.settle(within).await?;
        }
        let answer = self.exchange(self.line.position_query, Proof::Report, within).await?;
        answer.position.ok_or_else(|| self.line.wire.error(Cause::Silent { waited: within }))
    }

    /// Stops the motion and waits until the firmware answers again, which it does standing still.
    ///
    /// Unnumbered, so that it is obeyed whatever happened to the numbers before.
    pub(super) async fn quick_stop(&mut self, within: Duration) -> Result<(), RigError> {
        self.in_step = false;
        self.in_doubt = true;
        let until = Instant::now() + within;
        let stop = format!("\nM410\n{}\n", self.line.probe());
        self.line.wire.send(stop.as_bytes()).await?;
        if self.line.halted.is_some() {
            // It switches its motors off and will not answer.
            return Ok(());
        }
        let again = until.min(Instant::now() + STOP_AGAIN_AFTER);
        if !self.stopped(again).await? {
            self.line.wire.send(stop.as_bytes()).await?;
            if !self.stopped(until).await? {
                return Err(self.line.wire.error(Cause::Silent { waited: within }));
            }
        }
        Ok(())
    }

    /// Waits for the answer to the mark behind a stop, or for words of a firmware that has stopped its motors anyway.
    async fn stopped(&mut self, until: Instant) -> Result<bool, RigError> {
        while let Some(line) = self.line.wire.line(until).await? {
            match Reply::parse(&line) {
                Reply::Mark(mark) if mark == self.line.mark => return Ok(true),
                Reply::Position(_) if self.line.echoes_marks == Some(false) => return Ok(true),
                Reply::Started => return Ok(true),
                Reply::Halted => {
                    self.line.halted = Some(line);
                    return Ok(true);
                }
                _ => {}
            }
        }
        Ok(false)
    }

    /// Makes sure that no answer to what was asked before is still on its way.
    async fn settle(&mut self, within: Duration) -> Result<(), RigError> {
        if self.line.echoes_marks != Some(false) {
            let mark = self.line.probe();
            self.exchange(&mark, Proof::Mark, within).await?;
        }
        if self.line.echoes_marks == Some(false) {
            let mut silent_since = Instant::now();
            while let Some(line) = self.line.wire.line(silent_since + QUIET).await? {
                match Reply::parse(&line) {
                    Reply::Other => {}
                    Reply::Started => return Err(self.line.wire.error(Cause::Reset)),
                    Reply::Halted => return Err(self.line.halted(line)),
                    _ => silent_since = Instant::now(),
                }
            }
            self.in_doubt = false;
        }
        Ok(())
    }

    async fn exchange(
        &mut self,
        command: &str,
        proof: Proof,
        within: Duration,
    ) -> Result<Answer, RigError> {
        self.in_step = false;
        // An exchange that is cancelled or fails leaves answers on their way.
        let in_doubt = std::mem::replace(&mut self.in_doubt, true);
        let answer = exchange(&mut self.line, command, proof, within).await?;
        self.in_step = true;
        self.in_doubt = answer.in_doubt || (in_doubt && proof != Proof::Mark);
        Ok(answer)
    }
}
