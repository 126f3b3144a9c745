//! The connection to one firmware: lines and their answers, status reports.
//!
//! An `ok` lets things go on and proves nothing by itself: one may be lost, and the answer to an earlier line may come
//! late. So after each move the position is queried ([`Connection::status`]), and only the report counts.

mod reports;

use std::time::Duration;

use tokio::time::Instant;

use super::alarm;
use super::error_code::{self, HOMING_OFF, LOCKED};
use super::line::{Line, SOFT_RESET, STATUS_QUERY};
use super::reply::{Flavour, Reply};
use super::status::State;
use super::window::Window;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
pub(super) use reports::BETWEEN_QUERIES;

/// Silence after which the state is queried.
const QUIET: Duration = Duration::from_secs(1);

/// So many reports of a machine at rest, while a line waits for its answer, mean that line or answer were lost.
const REST_REPORTS: u32 = 3;

/// How long a firmware may take to start: boot loader, then banner.
const START_WITHIN: Duration = Duration::from_secs(20);

/// How long the answer to a reset may take before it is sent again.
const GREETS_WITHIN: Duration = Duration::from_millis(1500);

/// A stop is repeated at this interval until it is confirmed: its one byte may be lost.
const STOP_AGAIN: Duration = Duration::from_millis(80);

/// How long after a greeting there may be another one, or messages that belong to it.
const GREETING_ENDS: Duration = Duration::from_millis(150);

/// How long the firmware may take for a command of its own, such as writing a setting.
const COMMAND_WITHIN: Duration = Duration::from_secs(5);

/// How often a command whose answer was lost or damaged is repeated.
const MOST_REPEATS: u32 = 5;

/// Silence while homing after which it is asked whether homing is over: its `ok` may have been lost.
const HOMING_QUIET: Duration = Duration::from_secs(5);

/// Homing takes longer than this, at any speed: an `ok` that comes earlier may answer another line.
pub(super) const SHORTEST_HOMING: Duration = Duration::from_secs(1);

/// Homing again from the place where it ends takes longer than this, and any other command takes less. The switches' debounce
/// alone, 25 ms by default, comes several times for each axis.
pub(super) const SHORTEST_HOMING_AGAIN: Duration = Duration::from_millis(200);

/// What became of lines that were sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineOutcome {
    /// Each was answered `ok`.
    Taken,
    /// One was refused; the others were answered.
    Refused(u32),
    /// The machine stands still, and an answer is missing.
    Unanswered,
}

/// How long lines may take.
#[derive(Debug, Clone, Copy)]
struct Waits {
    /// So long they take anyway: nothing is asked before.
    expected: Duration,
    /// So long at most.
    within: Duration,
}

/// What it means that the machine is locked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lock {
    /// It has not been homed yet, and stands still.
    IsRest,
    /// Something happened in a move.
    IsAFault,
}

/// The conversation with one firmware.
#[derive(Debug)]
pub(super) struct Connection<L> {
    pub(super) wire: Wire<L>,
    window: Window,
    flavour: Flavour,
    name: String,
    /// The first refusal of the lines under way.
    refused: Option<u32>,
    /// Resets sent and not yet greeted: any other greeting is the firmware's own.
    resets_due: u32,
    last_query: Option<Instant>,
    /// Queries sent and not yet reported on: only the last report speaks of now.
    reports_due: u32,
    work_offset: Option<[f64; 3]>,
    mm_per_unit: f64,
}

impl<L: ByteLink> Connection<L> {
    pub(super) fn new(wire: Wire<L>) -> Self {
        Self {
            wire,
            window: Window::new(),
            flavour: Flavour::Grbl,
            name: String::new(),
            refused: None,
            resets_due: 0,
            last_query: None,
            reports_due: 0,
            work_offset: None,
            mm_per_unit: 1.0,
        }
    }

    /// Which dialect greeted.
    pub(super) fn flavour(&self) -> Flavour {
        self.flavour
    }

    /// How the firmware called itself when it greeted.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn set_receive_buffer(&mut self, bytes: usize) {
        self.window.set_buffer(bytes);
    }

    pub(super) fn set_reports_inches(&mut self, inches: bool) {
        self.mm_per_unit = if inches { 25.4 } else { 1.0 };
    }

    /// Brings a firmware, which may just be starting, to rest and to a greeting.
    pub(super) async fn begin(&mut self) -> Result<(), RigError> {
        self.reset(START_WITHIN, GREETS_WITHIN).await?;
        let quiet = || Instant::now() + GREETING_ENDS;
        while let Some(line) = self.wire.line(quiet()).await? {
            if let Reply::Greeting(flavour) = Reply::parse(&line) {
                self.greeted(flavour, &line);
            }
        }
        self.resets_due = 0;
        Ok(())
    }

    /// Stops whatever moves and waits for the greeting that confirms it.
    pub(super) async fn stop(&mut self, within: Duration) -> Result<(), RigError> {
        self.reset(within, STOP_AGAIN).await
    }

    /// Resets the firmware again and again until it greets.
    ///
    /// Commands that were not executed are discarded, including a line that arrived in part.
    async fn reset(&mut self, within: Duration, again: Duration) -> Result<(), RigError> {
        let until = Instant::now() + within;
        let (mut other_firmware, mut sent) = (None, 0);
        while Instant::now() < until {
            self.wire.send(SOFT_RESET).await?;
            self.resets_due += 1;
            sent += 1;
            if sent > 1 {
                // Another firmware takes the byte for the beginning of a line, and answers its end.
                self.wire.send(b"\n").await?;
            }
            let next = until.min(Instant::now() + again);
            while let Some(line) = self.wire.line(next).await? {
                match Reply::parse(&line) {
                    Reply::Greeting(flavour) => {
                        self.greeted(flavour, &line);
                        return Ok(());
                    }
                    Reply::OtherFirmware => other_firmware = Some(line),
                    _ => {}
                }
            }
            if let Some(received) = other_firmware {
                return Err(self.wire.error(Cause::OtherFirmware { named: "GRBL", received }));
            }
        }
        Err(self.wire.error(Cause::Silent { waited: within }))
    }

    fn greeted(&mut self, flavour: Flavour, line: &str) {
        self.flavour = flavour;
        self.name = line.split(" [").next().unwrap_or(line).to_owned();
        self.window.clear();
        self.resets_due = self.resets_due.saturating_sub(1);
        self.reports_due = 0;
        self.work_offset = None;
    }

    /// Sends a `$` command by itself and returns the answer: `accept` decides whether it is complete.
    ///
    /// Asked again where an answer is lost or damaged.
    pub(super) async fn ask(
        &mut self,
        command: &str,
        accept: impl Fn(&[String]) -> bool,
    ) -> Result<Vec<String>, RigError> {
        let line = self.line(command)?;
        for _ in 0..MOST_REPEATS {
            let mut answer = Vec::new();
            match self.exchange_at_rest(&line, &mut answer).await? {
                LineOutcome::Taken if accept(&answer) => return Ok(answer),
                LineOutcome::Taken => {}
                // What the machine may be asked while it is locked is never refused for the lock.
                LineOutcome::Refused(code)
                    if code != LOCKED && !error_code::may_be_damage(code) =>
                {
                    return Err(self.refused(code));
                }
                LineOutcome::Refused(_) => self.clear_error().await?,
                LineOutcome::Unanswered => self.begin().await?,
            }
        }
        Err(self.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    /// Sends lines as the receive buffer has room for them and waits for their answers.
    ///
    /// Before `expected` is over the state is not queried: the report of a query at the end of a move would delay the answer
    /// that shows the end, and rows at constant speed are located by it.
    pub(super) async fn run(
        &mut self,
        lines: &[Line],
        expected: Duration,
        within: Duration,
    ) -> Result<LineOutcome, RigError> {
        let waits = Waits { expected, within };
        let outcome = self.exchange(lines, waits, Lock::IsAFault, &mut Vec::new()).await?;
        if let LineOutcome::Refused(LOCKED) = outcome
            && self.state().await? == State::Alarm
        {
            return Err(self.alarm("error:9".to_owned(), error_code::meaning(LOCKED)));
        }
        Ok(outcome)
    }

    /// Ends the lock behind a soft limit, by which the firmware has refused a line before any step.
    ///
    /// One inverted bit makes homing, `$H`, of the command. So it is repeated only while the machine reports that it rests, and
    /// the caller has to see that its place is the one before.
    pub(super) async fn unlock(&mut self) -> Result<(), RigError> {
        let line = self.line("$X")?;
        let waits = Waits { expected: Duration::ZERO, within: COMMAND_WITHIN };
        for _ in 0..MOST_REPEATS {
            match self
                .exchange(std::slice::from_ref(&line), waits, Lock::IsRest, &mut Vec::new())
                .await
            {
                Ok(LineOutcome::Taken) => return Ok(()),
                Ok(LineOutcome::Refused(code))
                    if code == LOCKED || error_code::may_be_damage(code) =>
                {
                    self.clear_error().await?;
                }
                Ok(LineOutcome::Refused(code)) => return Err(self.refused(code)),
                Ok(LineOutcome::Unanswered) => self.begin().await?,
                // While it homes, GRBL reports nothing.
                Err(error)
                    if matches!(error.cause(), Cause::Silent { .. })
                        && matches!(self.state().await?, State::Idle | State::Alarm) =>
                {
                    self.begin().await?;
                }
                Err(error) => return Err(error),
            }
        }
        Err(self.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    async fn exchange(
        &mut self,
        lines: &[Line],
        Waits { expected, within }: Waits,
        lock: Lock,
        answer: &mut Vec<String>,
    ) -> Result<LineOutcome, RigError> {
        let begun = Instant::now();
        let deadline = begun + within;
        let (mut next, mut rests, mut moves) = (0, 0, false);
        self.refused = None;
        loop {
            while let Some(line) =
                lines.get(next).filter(|line| self.window.has_room_for(line.bytes().len()))
            {
                self.wire.send(line.bytes()).await?;
                self.window.sent(line.bytes().len());
                next += 1;
            }
            if next == lines.len() && self.window.is_empty() {
                return Ok(self.refused.map_or(LineOutcome::Taken, LineOutcome::Refused));
            }
            let quiet = Instant::now().max(begun + expected) + QUIET;
            let Some(line) = self.wire.line(quiet.min(deadline)).await? else {
                if Instant::now() >= deadline {
                    let silent = Cause::Silent { waited: within };
                    return Err(self.wire.error(if moves { Cause::StillMoving } else { silent }));
                }
                // A dwell and the end of a move show as `Idle` too, once; one that stays is standstill.
                let state = self.status().await?.state;
                moves = state == State::Run;
                rests = match state {
                    State::Idle => rests + 1,
                    State::Alarm if lock == Lock::IsRest => rests + 1,
                    State::Alarm => return Err(self.alarm_state()),
                    State::Run | State::Jog | State::Home => 0,
                    state => return Err(self.paused(state)),
                };
                if rests == REST_REPORTS && !self.window.is_empty() {
                    return Ok(LineOutcome::Unanswered);
                }
                continue;
            };
            match Reply::parse(&line) {
                Reply::Status(status) => self.note(&status),
                Reply::Other | Reply::Setting(..) => answer.push(line),
                reply => self.take(reply, line)?,
            }
        }
    }

    /// Sends one line that moves nothing. Where nothing was understood in time, its answer counts as lost.
    async fn exchange_at_rest(
        &mut self,
        line: &Line,
        answer: &mut Vec<String>,
    ) -> Result<LineOutcome, RigError> {
        let lines = std::slice::from_ref(line);
        let waits = Waits { expected: Duration::ZERO, within: COMMAND_WITHIN };
        match self.exchange(lines, waits, Lock::IsRest, answer).await {
            Err(error) if matches!(error.cause(), Cause::Silent { .. }) => {
                Ok(LineOutcome::Unanswered)
            }
            outcome => outcome,
        }
    }

    /// Ends the state in which grblHAL repeats its last error; elsewhere a blank line does nothing.
    pub(super) async fn clear_error(&mut self) -> Result<(), RigError> {
        let blank = self.line("")?;
        match self.exchange_at_rest(&blank, &mut Vec::new()).await? {
            LineOutcome::Taken | LineOutcome::Refused(_) => Ok(()),
            LineOutcome::Unanswered => self.begin().await,
        }
    }

    /// Sends a homing command and waits for its end. Returns whether an `ok` came after `shortest`; otherwise the machine
    /// rests, homed or not.
    ///
    /// GRBL answers nothing while it homes, not even `?`; a query is answered afterwards.
    pub(super) async fn home(
        &mut self,
        command: &str,
        shortest: Duration,
        within: Duration,
    ) -> Result<bool, RigError> {
        let line = self.line(command)?;
        let begun = Instant::now();
        let deadline = begun + within;
        self.wire.send(line.bytes()).await?;
        let mut rests = 0;
        loop {
            let quiet = Instant::now() + HOMING_QUIET;
            let Some(received) = self.wire.line(quiet.min(deadline)).await? else {
                if Instant::now() >= deadline {
                    return Err(self.wire.error(Cause::Silent { waited: within }));
                }
                self.ask_for_a_report().await?;
                continue;
            };
            match Reply::parse(&received) {
                Reply::Ok if begun.elapsed() > shortest => return Ok(true),
                // Of a command before it that came twice; or homing takes no time, as where time is simulated.
                Reply::Ok => {
                    rests = 1;
                    self.ask_for_a_report().await?;
                }
                Reply::Error(HOMING_OFF) => return Err(self.wire.error(homing_is_off())),
                Reply::Error(code) if error_code::may_be_damage(code) => {
                    self.clear_error().await?;
                    return Ok(false);
                }
                Reply::Error(code) => return Err(self.refused(code)),
                Reply::Alarm(code) => {
                    self.swallow_failed_homing().await?;
                    return Err(self.alarm(received, alarm::meaning(code)));
                }
                Reply::Status(status) => {
                    self.note(&status);
                    match status.state {
                        // Its `ok` was lost, or the command itself.
                        State::Idle | State::Alarm if rests > 0 => return Ok(false),
                        State::Idle | State::Alarm => rests += 1,
                        _ => rests = 0,
                    }
                }
                reply => self.take(reply, received)?,
            }
        }
    }

    async fn ask_for_a_report(&mut self) -> Result<(), RigError> {
        self.wire.send(STATUS_QUERY).await?;
        self.last_query = Some(Instant::now());
        self.reports_due = 1;
        Ok(())
    }

    /// What follows the alarm of a failed homing: an `ok`, then the greeting.
    async fn swallow_failed_homing(&mut self) -> Result<(), RigError> {
        let until = Instant::now() + GREETS_WITHIN;
        while let Some(line) = self.wire.line(until).await? {
            if let Reply::Greeting(flavour) = Reply::parse(&line) {
                self.greeted(flavour, &line);
                return Ok(());
            }
        }
        Ok(())
    }

    fn line(&self, text: &str) -> Result<Line, RigError> {
        Line::new(text).map_err(|cause| self.wire.error(cause))
    }

    /// The fault for a refusal.
    pub(super) fn refused(&self, code: u32) -> RigError {
        let reply = format!("error:{code}, {}", error_code::meaning(code));
        self.wire.error(Cause::Refused { reply })
    }

    /// The fault for a machine that waits for somebody.
    pub(super) fn paused(&self, state: State) -> RigError {
        self.wire.error(Cause::Paused { state: format!("{state:?}").to_lowercase() })
    }

    /// The fault for an alarm whose code was lost.
    pub(super) fn alarm_state(&self) -> RigError {
        self.alarm("Alarm".to_owned(), "the firmware locked itself; the position may be lost")
    }

    fn alarm(&self, reply: String, meaning: &'static str) -> RigError {
        self.wire.error(Cause::Alarm { reply, meaning })
    }

    /// Handles replies that no caller waits for.
    fn take(&mut self, reply: Reply, line: String) -> Result<(), RigError> {
        match reply {
            Reply::Ok => {
                self.window.answered();
            }
            Reply::Error(code) => {
                self.window.answered();
                self.refused = self.refused.or(Some(code));
            }
            Reply::Alarm(code) => return Err(self.alarm(line, alarm::meaning(code))),
            Reply::Greeting(flavour) => {
                let expected = self.resets_due > 0;
                self.greeted(flavour, &line);
                if !expected {
                    return Err(self.wire.error(Cause::Reset));
                }
            }
            Reply::OtherFirmware => {
                return Err(self
                    .wire
                    .error(Cause::OtherFirmware { named: "GRBL", received: line }));
            }
            Reply::Status(_) | Reply::Setting(..) | Reply::Other => {}
        }
        Ok(())
    }
}

/// The fault for disabled homing.
pub(super) fn homing_is_off() -> Cause {
    Cause::Setting {
        name: "$22".to_owned(),
        problem: "homing is off, so the position cannot be determined".to_owned(),
    }
}
