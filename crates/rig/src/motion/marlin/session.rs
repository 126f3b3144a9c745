//! One command at a time, each accounted for.
//!
//! A line may be damaged on its way there and its `ok` on the way back. What is done about it rests on one fact: the
//! firmware takes numbered lines in order and executes them in order. So
//!
//! - after `Resend: k` the lines from `k` on are sent again, one by one;
//! - after silence a mark that was never used before is sent under the next number, for the firmware to say back
//!   (`M118`). If the line before was lost, the mark is answered by a `Resend` of it; if only its `ok` was lost, by
//!   the mark. A build without `M118` says it back too, as an unknown command. One that takes it and says nothing gives itself
//!   away when the session begins: there a silence settles what may be late, and a report proves;
//! - an `ok` may be one too many (after a `Resend`, after silence), so an `ok` lets things go on and proves nothing.
//!   A mark said back proves that all before it was executed, however late it comes;
//! - whatever is said behind a mark was asked for behind it. So where anything was lost since the last one, a mark is
//!   heard first, and then the position is asked for: no late report is taken for the answer.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use super::line::numbered;
use super::reply::Reply;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::motion::grbl::is_grbl;
use crate::space::RobotPosition;

/// Silence after which something is taken for lost. The firmware says that it is busy every 2 s.
const QUIET: Duration = Duration::from_secs(3);

/// How long after a `Resend` its empty `ok` may come; builds that omit it cost this much a resend.
const EMPTY_OK_WITHIN: Duration = Duration::from_millis(250);

/// Marks sent into one silence; the firmware's command ring holds four lines.
const MOST_PROBES: u32 = 3;

/// Marks taken and not said back before any ever was, after which a build is known not to say them.
const MARKS_UNSAID: u32 = 2;

/// Reports that may be lost in one exchange.
const MOST_LOST_REPORTS: u32 = 5;

/// Resends answered within one exchange.
const MOST_RESENDS: u32 = 10;

/// Lines kept for a resend. One is under way at a time, and probes behind it.
const KEPT_LINES: usize = 8;

/// What marks begin with.
pub(super) const MARK: &str = "fieldgap-";

/// How long a firmware may take to start: boot loader, then banner, then settings.
const START_WITHIN: Duration = Duration::from_secs(20);

/// Silence during the start after which the opening line is sent again.
const START_QUIET: Duration = Duration::from_secs(1);

/// How long the answer to a stop may take before it is sent again: several times within the half second in which a rig is
/// made safe.
const STOP_AGAIN_AFTER: Duration = Duration::from_millis(150);

/// What ends an exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Proof {
    /// The command was taken.
    Ok,
    /// It was said back.
    Mark,
    /// A position was reported behind it.
    Report,
}

/// What an exchange brought.
#[derive(Debug, Default)]
pub(super) struct Answer {
    /// Lines that are neither acknowledgement nor error.
    pub(super) lines: Vec<String>,
    /// The firmware's words where it does not know the command.
    pub(super) unknown: Option<String>,
    position: Option<RobotPosition>,
    /// Whether something may still be said to it.
    in_doubt: bool,
}

/// The numbered conversation with one firmware.
#[derive(Debug)]
pub(super) struct Session<L> {
    pub(super) wire: Wire<L>,
    next: u32,
    sent: VecDeque<(u32, String)>,
    /// False from the start of an exchange until its good end, so a cancelled one leaves it false.
    in_step: bool,
    /// Whether this build has been heard to say that it is busy, so that its silence means something.
    says_busy: bool,
    position_query: &'static str,
    /// The last mark; no two are alike.
    mark: u32,
    /// Whether this build says marks back; not known before the first exchange.
    says_marks: Option<bool>,
    /// Whether something was lost or cut short since a mark was last heard, so that answers to it may still come.
    in_doubt: bool,
}

impl<L: ByteLink> Session<L> {
    pub(super) fn new(wire: Wire<L>) -> Self {
        Self {
            wire,
            next: 1,
            sent: VecDeque::new(),
            in_step: false,
            says_busy: false,
            // The true position in builds that have it; the others ignore the letter.
            position_query: "M114 R",
            mark: 0,
            says_marks: None,
            in_doubt: true,
        }
    }

    /// Whether firmware and program agree on the line numbers, so that a command can be sent.
    pub(super) fn in_step(&self) -> bool {
        self.in_step
    }

    /// Agrees on line numbers with a firmware that may just be starting.
    pub(super) async fn begin(&mut self) -> Result<(), RigError> {
        self.in_step = false;
        self.in_doubt = true;
        self.sent.clear();
        self.next = 1;
        let opening = numbered(0, "M110 N0").map_err(|cause| self.wire.error(cause))?;
        let until = Instant::now() + START_WITHIN;
        while Instant::now() < until {
            self.wire.send(opening.as_bytes()).await?;
            while let Some(line) = self.wire.line(until.min(Instant::now() + START_QUIET)).await? {
                if is_grbl(&line) {
                    return Err(self
                        .wire
                        .error(Cause::OtherFirmware { named: "Marlin", heard: line }));
                }
                match Reply::parse(&line) {
                    Reply::Ok { .. } => {
                        // Several openings may have been answered; the mark settles every `ok` of theirs.
                        return self.position(START_WITHIN).await.map(drop);
                    }
                    Reply::Halted => return Err(self.wire.error(Cause::Halted { reply: line })),
                    _ => {}
                }
            }
        }
        Err(self.wire.error(Cause::Silent { waited: START_WITHIN }))
    }

    /// Sends a command and waits until the firmware has taken it.
    pub(super) async fn command(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<Answer, RigError> {
        self.exchange(command, Proof::Ok, within).await
    }

    /// As [`Session::command`], for one that every build must know.
    pub(super) async fn required(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<(), RigError> {
        match self.command(command, within).await?.unknown {
            None => Ok(()),
            Some(reply) => Err(self.wire.error(Cause::Refused { reply })),
        }
    }

    /// Asks where the robot is. Everything sent before has been executed when this returns.
    pub(super) async fn position(&mut self, within: Duration) -> Result<RobotPosition, RigError> {
        if self.in_doubt {
            self.settle(within).await?;
        }
        let answer = self.exchange(self.position_query, Proof::Report, within).await?;
        answer.position.ok_or_else(|| self.wire.error(Cause::Silent { waited: within }))
    }

    /// Stops the motion and waits until the firmware answers again, which it does standing still.
    ///
    /// Unnumbered, so that it is obeyed whatever happened to the numbers before.
    pub(super) async fn quick_stop(&mut self, within: Duration) -> Result<(), RigError> {
        self.in_step = false;
        self.in_doubt = true;
        let until = Instant::now() + within;
        let probe = self.probe();
        while Instant::now() < until {
            self.wire.send(format!("\nM410\n{probe}\n").as_bytes()).await?;
            let again = until.min(Instant::now() + STOP_AGAIN_AFTER);
            while let Some(line) = self.wire.line(again).await? {
                match Reply::parse(&line) {
                    Reply::Mark(mark) if mark == self.mark => return Ok(()),
                    Reply::Position(_) if self.says_marks == Some(false) => return Ok(()),
                    // A firmware that restarted or halted has stopped its motors too.
                    Reply::Started | Reply::Halted => return Ok(()),
                    _ => {}
                }
            }
        }
        Err(self.wire.error(Cause::Silent { waited: within }))
    }

    /// Makes sure that no answer to what was asked before is still on its way.
    async fn settle(&mut self, within: Duration) -> Result<(), RigError> {
        if self.says_marks != Some(false) {
            let mark = self.probe();
            self.exchange(&mark, Proof::Mark, within).await?;
        }
        if self.says_marks == Some(false) {
            let mut silent_since = Instant::now();
            while let Some(line) = self.wire.line(silent_since + QUIET).await? {
                match Reply::parse(&line) {
                    Reply::Other => {}
                    Reply::Started => return Err(self.wire.error(Cause::Reset)),
                    Reply::Halted => return Err(self.wire.error(Cause::Halted { reply: line })),
                    _ => silent_since = Instant::now(),
                }
            }
            self.in_doubt = false;
        }
        Ok(())
    }

    /// What shows by its answer that all before it was executed: a mark never used before in this session, and soon not again; or
    /// a position query, where marks are not said back.
    fn probe(&mut self) -> String {
        if self.says_marks == Some(false) {
            return self.position_query.to_owned();
        }
        self.mark = self.mark.wrapping_add(1);
        format!("M118 {MARK}{}", self.mark)
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
        let answer = self.exchange_steps(command, proof, within).await?;
        self.in_step = true;
        self.in_doubt = answer.in_doubt || (in_doubt && proof != Proof::Mark);
        Ok(answer)
    }

    async fn exchange_steps(
        &mut self,
        command: &str,
        proof: Proof,
        within: Duration,
    ) -> Result<Answer, RigError> {
        let deadline = Instant::now() + within;
        let mut answer = Answer::default();
        let (mut probes, mut resends, mut lost_reports, mut unsaid) = (0, 0, 0, 0);
        let mut wanted: Option<Wanted> = None;
        // Whether the last mark was said back, if one is waited for.
        let mut marked = None;
        if proof == Proof::Mark {
            marked = Some(false);
        }
        // The line that the firmware is expected to answer next, and the last one it has to answer.
        let mut last = self.number(command)?;
        let mut current = last;
        self.write(current).await?;
        let mut silent_since = Instant::now();
        loop {
            let quiet =
                wanted.as_ref().map_or(silent_since + QUIET, |wanted| wanted.empty_ok_until);
            let Some(line) = self.wire.line(deadline.min(quiet)).await? else {
                if let Some(Wanted { line, .. }) = wanted.take() {
                    current = line;
                    self.write(current).await?;
                } else if answer.position.is_some()
                    || (marked == Some(true) && proof != Proof::Report)
                {
                    // It is proved, and only an `ok` was lost.
                    answer.in_doubt = true;
                    return Ok(answer);
                } else if self.says_marks.is_none() && unsaid >= MARKS_UNSAID {
                    self.says_marks = Some(false);
                    return Ok(answer);
                } else if Instant::now() >= deadline || (probes == MOST_PROBES && self.says_busy) {
                    return Err(self.wire.error(Cause::Silent { waited: within }));
                } else if probes < MOST_PROBES {
                    probes += 1;
                    answer.in_doubt = true;
                    marked = Some(false);
                    let probe = self.probe();
                    last = self.number(&probe)?;
                    current = last;
                    self.write(current).await?;
                }
                silent_since = Instant::now();
                continue;
            };
            for reply in Reply::all(&line) {
                if reply != Reply::Other {
                    // Notes and temperatures come on their own, and say nothing about the line under way.
                    silent_since = Instant::now();
                }
                match reply {
                    Reply::Ok { .. } if wanted.is_some() => {
                        current = wanted.take().map_or(current, |wanted| wanted.line);
                        self.write(current).await?;
                    }
                    // An `ok` that names another line is one too many.
                    Reply::Ok { line: Some(number) } if number != current => {}
                    Reply::Ok { .. } if current < last => {
                        current += 1;
                        self.write(current).await?;
                    }
                    Reply::Ok { .. } if answer.position.is_some() => return Ok(answer),
                    Reply::Ok { .. } if proof == Proof::Report && marked == Some(true) => {
                        // The query was obeyed and its report lost: whatever is reported from now on is asked for now.
                        lost_reports += 1;
                        if lost_reports > MOST_LOST_REPORTS {
                            return Err(self
                                .wire
                                .error(Cause::KeepsGarbling { times: lost_reports }));
                        }
                        marked = None;
                        last = self.number(self.position_query)?;
                        current = last;
                        self.write(current).await?;
                    }
                    Reply::Ok { .. } if proof != Proof::Report && marked != Some(false) => {
                        return Ok(answer);
                    }
                    Reply::Ok { .. } => unsaid += 1,
                    Reply::Resend(line) => {
                        resends += 1;
                        if resends > MOST_RESENDS {
                            return Err(self.wire.error(Cause::KeepsGarbling { times: resends }));
                        }
                        if line != last + 1 {
                            self.must_have_sent(line)?;
                            let empty_ok_until = Instant::now() + EMPTY_OK_WITHIN;
                            wanted = Some(Wanted { line, empty_ok_until });
                        }
                        // Else noise was taken for a line after ours: ours was taken, and its `ok` is due.
                    }
                    Reply::Position(position) if proof == Proof::Report && current == last => {
                        answer.position = Some(position);
                    }
                    Reply::Position(_) if self.says_marks == Some(false) => {
                        marked = marked.map(|_| true);
                    }
                    Reply::Position(_) => {}
                    Reply::Mark(mark) if mark == self.mark => {
                        self.says_marks = Some(true);
                        marked = marked.map(|_| true);
                    }
                    // Late, from an earlier silence.
                    Reply::Mark(_) => {}
                    Reply::UnknownCommand if line.contains("M114") => {
                        if self.position_query == "M114" {
                            return Err(self.wire.error(Cause::Refused { reply: line.clone() }));
                        }
                        // The query in its plain form takes the place of the one refused.
                        self.position_query = "M114";
                        last = self.number(self.position_query)?;
                        current = last;
                        self.write(current).await?;
                    }
                    Reply::UnknownCommand => answer.unknown = Some(line.clone()),
                    Reply::Busy => self.says_busy = true,
                    Reply::Started => return Err(self.wire.error(Cause::Reset)),
                    Reply::Halted => {
                        return Err(self.wire.error(Cause::Halted { reply: line.clone() }));
                    }
                    Reply::EndstopHit => {
                        return Err(self.wire.error(Cause::EndstopHit { reply: line.clone() }));
                    }
                    Reply::Error => {
                        return Err(self.wire.error(Cause::Refused { reply: line.clone() }));
                    }
                    Reply::TransmissionError => {}
                    Reply::Other => answer.lines.push(line.clone()),
                }
            }
        }
    }

    /// Gives a command the next number and keeps it for a resend.
    fn number(&mut self, command: &str) -> Result<u32, RigError> {
        let number = self.next;
        let line = numbered(number, command).map_err(|cause| self.wire.error(cause))?;
        self.sent.push_back((number, line));
        if self.sent.len() > KEPT_LINES {
            self.sent.pop_front();
        }
        self.next += 1;
        Ok(number)
    }

    async fn write(&mut self, number: u32) -> Result<(), RigError> {
        let line = self.sent.iter().find(|(sent, _)| *sent == number).map(|(_, line)| line.clone());
        match line {
            Some(line) => self.wire.send(line.as_bytes()).await,
            None => Err(self.wire.error(Cause::OutOfStep { wanted: number })),
        }
    }

    fn must_have_sent(&self, wanted: u32) -> Result<(), RigError> {
        if self.sent.iter().any(|(sent, _)| *sent == wanted) {
            return Ok(());
        }
        // A firmware that restarted counts from the beginning, even if its `start` was lost.
        let cause = if wanted <= 1 { Cause::Reset } else { Cause::OutOfStep { wanted } };
        Err(self.wire.error(cause))
    }
}

/// A line that the firmware wants again.
#[derive(Debug)]
struct Wanted {
    line: u32,
    /// Until when the `ok` that belongs to the `Resend` itself is waited for before the line is sent.
    empty_ok_until: Instant,
}
