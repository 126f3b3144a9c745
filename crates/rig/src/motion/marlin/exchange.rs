//! One command under way, from its first line to the answer that ends it.
//!
//! A line may be damaged on its way there and its `ok` on the way back. Recovery rests on one fact: the firmware takes
//! numbered lines in order and executes them in order.
//!
//! - After `Resend: k` the lines from `k` on are sent again, one by one.
//! - After silence a mark that was never used before is sent under the next number, for the firmware to echo (`M118`).
//!   If the line before was lost, the answer is a `Resend` of it. If only its `ok` was lost, the answer is the mark. A
//!   build without `M118` echoes it too, as an unknown command. A build that takes the mark and echoes nothing is
//!   recognised when the session begins. There a pause ends what may be late, and a position report is the proof.
//! - A line whose `N` is damaged has no number for the firmware, which takes it for an unknown command. So a complaint that
//!   repeats other words than were sent is damage, and the line is sent again: where it was taken after all, the firmware
//!   drops the repeat. Any other error counts once a mark has shown that the line was taken.
//! - A `Resend` of a line that is not kept may be damaged itself. It counts when the same is asked for twice.
//! - An `ok` may be one too many (after a `Resend`, after silence). So an `ok` allows the next line and proves nothing.
//!   An echoed mark proves that all before it was executed, however late it comes.

use std::ops::ControlFlow;
use std::time::Duration;

use tokio::time::Instant;

use super::numbered_line::NumberedLine;
use super::reply::Reply;
use crate::error::{Cause, RigError};
use crate::link::ByteLink;
use crate::motion::firmware::Firmware;
use crate::space::RobotPosition;

/// Silence after which something is taken for lost. The firmware says that it is busy every 2 s.
pub(super) const QUIET: Duration = Duration::from_secs(3);

/// How long after a `Resend` its empty `ok` may come; builds that omit it cost this much a resend.
const EMPTY_OK_WITHIN: Duration = Duration::from_millis(250);

/// Marks sent without any answer; the firmware's command ring holds four lines.
const MOST_PROBES: u32 = 3;

/// Marks taken and not echoed before any ever was, after which a build is known not to echo them.
const MARKS_NOT_ECHOED: u32 = 2;

/// Reports that may be lost in one exchange.
const MOST_LOST_REPORTS: u32 = 5;

/// Resends answered within one exchange.
const MOST_RESENDS: u32 = 10;

/// What ends an exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Proof {
    /// The command was taken.
    Ok,
    /// It was echoed.
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
    pub(super) position: Option<RobotPosition>,
    /// Whether a late answer may still come.
    pub(super) in_doubt: bool,
}

/// A line that the firmware asked for again. It is sent after the empty `ok` that follows, or at the end of the wait for it.
struct Resend {
    number: u32,
    empty_ok_until: Instant,
}

/// What has been sent and answered so far.
struct Exchange<'a, L> {
    line: &'a mut NumberedLine<L>,
    proof: Proof,
    within: Duration,
    deadline: Instant,
    silent_since: Instant,
    answer: Answer,
    /// The number of the line that the firmware is expected to answer next.
    current: u32,
    /// The number of the last line that it has to answer.
    last: u32,
    resend: Option<Resend>,
    /// An error whose cause is not known: noise on the line, or a refusal of the command.
    complaint: Option<String>,
    /// The last number asked for that no line has which is kept.
    not_kept: Option<u32>,
    /// Whether the last mark was echoed, if one is waited for.
    marked: Option<bool>,
    probes: u32,
    resends: u32,
    lost_reports: u32,
    marks_not_echoed: u32,
}

/// Sends a command and reads answers until `proof` has come.
///
/// # Errors
/// That the firmware fell silent, restarted, halted or refused, or that the line keeps being damaged.
pub(super) async fn exchange<L: ByteLink>(
    line: &mut NumberedLine<L>,
    command: &str,
    proof: Proof,
    within: Duration,
) -> Result<Answer, RigError> {
    let deadline = Instant::now() + within;
    let number = line.number(command)?;
    line.write(number).await?;
    let mut exchange = Exchange {
        line,
        proof,
        within,
        deadline,
        silent_since: Instant::now(),
        answer: Answer::default(),
        current: number,
        last: number,
        resend: None,
        complaint: None,
        not_kept: None,
        marked: (proof == Proof::Mark).then_some(false),
        probes: 0,
        resends: 0,
        lost_reports: 0,
        marks_not_echoed: 0,
    };
    loop {
        let until = exchange.deadline.min(exchange.quiet_until());
        let flow = match exchange.line.wire.line(until).await? {
            Some(received) => exchange.take_line(&received).await?,
            None => exchange.take_silence().await?,
        };
        if flow.is_break() {
            return match exchange.complaint.take() {
                Some(reply) => Err(exchange.error(Cause::Refused { reply })),
                None => Ok(exchange.answer),
            };
        }
    }
}

/// Whether the exchange goes on.
type Flow = Result<ControlFlow<()>, RigError>;

const GO_ON: Flow = Ok(ControlFlow::Continue(()));
const DONE: Flow = Ok(ControlFlow::Break(()));

impl<L: ByteLink> Exchange<'_, L> {
    /// When silence calls for action.
    fn quiet_until(&self) -> Instant {
        self.resend.as_ref().map_or(self.silent_since + QUIET, |resend| resend.empty_ok_until)
    }

    async fn take_silence(&mut self) -> Flow {
        let mark_came = self.marked == Some(true) && self.proof != Proof::Report;
        if let Some(Resend { number, .. }) = self.resend.take() {
            self.send(number).await?;
        } else if self.answer.position.is_some() || mark_came {
            // The proof came, and only an `ok` was lost.
            self.answer.in_doubt = true;
            return DONE;
        } else if self.line.echoes_marks.is_none() && self.marks_not_echoed >= MARKS_NOT_ECHOED {
            self.line.echoes_marks = Some(false);
            return DONE;
        } else if Instant::now() >= self.deadline
            || (self.probes == MOST_PROBES && self.line.reports_busy)
        {
            return Err(self.line.silent(self.within));
        } else if self.probes < MOST_PROBES {
            self.send_mark().await?;
        }
        self.silent_since = Instant::now();
        GO_ON
    }

    async fn take_line(&mut self, received: &str) -> Flow {
        // Its `ok` would be taken for one.
        if Firmware::of_line(received) == Some(Firmware::Klipper) {
            let received = received.to_owned();
            return Err(self.error(Cause::OtherFirmware { named: "Marlin", received }));
        }
        for reply in Reply::all(received) {
            if reply != Reply::Other {
                // Notes and temperatures come on their own, and show nothing about the line under way.
                self.silent_since = Instant::now();
                self.probes = 0;
            }
            if self.take_reply(reply, received).await?.is_break() {
                return DONE;
            }
        }
        GO_ON
    }

    async fn take_reply(&mut self, reply: Reply, received: &str) -> Flow {
        let words = || received.to_owned();
        match reply {
            Reply::Ok { line } => return self.take_ok(line).await,
            Reply::Resend(number) => self.take_resend(number)?,
            Reply::Position(position) => self.take_position(position),
            Reply::Mark(mark) if mark == self.line.mark => {
                self.line.echoes_marks = Some(true);
                self.marked = self.marked.map(|_| true);
            }
            // Late, from an earlier silence.
            Reply::Mark(_) => {}
            Reply::UnknownCommand if !self.line.repeats(self.current, received) => {
                self.ask_for_again(self.current)?;
            }
            Reply::UnknownCommand if received.contains("M114") => {
                self.take_unknown_query(received).await?
            }
            Reply::UnknownCommand => self.answer.unknown = Some(words()),
            Reply::Busy => self.line.reports_busy = true,
            Reply::Started => return Err(self.error(Cause::Reset)),
            Reply::Halted => return Err(self.line.halted(words())),
            Reply::EndstopHit => return Err(self.error(Cause::EndstopHit { reply: words() })),
            Reply::Error => self.complaint = Some(words()),
            Reply::TransmissionError => self.complaint = None,
            Reply::Other => self.answer.lines.push(words()),
        }
        GO_ON
    }

    async fn take_ok(&mut self, number: Option<u32>) -> Flow {
        if let Some(Resend { number, .. }) = self.resend.take() {
            self.send(number).await?;
        } else if number.is_some_and(|number| number != self.current) {
            // An `ok` that names another line is one too many.
        } else if self.current < self.last {
            self.send(self.current + 1).await?;
        } else if self.complaint.is_some() && self.marked.is_none() {
            self.send_mark().await?;
        } else if self.answer.position.is_some() {
            return DONE;
        } else if self.proof == Proof::Report && self.marked == Some(true) {
            // The query was obeyed and its report lost. Any report from now on answers the query sent now.
            self.lost_reports += 1;
            if self.lost_reports > MOST_LOST_REPORTS {
                return Err(self.error(Cause::RepeatedlyDamaged { times: self.lost_reports }));
            }
            self.marked = None;
            self.send_new(self.line.position_query).await?;
        } else if self.proof != Proof::Report && self.marked != Some(false) {
            return DONE;
        } else {
            self.marks_not_echoed += 1;
        }
        GO_ON
    }

    fn take_resend(&mut self, number: u32) -> Result<(), RigError> {
        self.complaint = None;
        // One line too far: noise was taken for a line after the last. The last was taken, and its `ok` is due.
        if number == self.last + 1 {
            return Ok(());
        }
        if self.line.keeps(number) {
            return self.ask_for_again(number);
        }
        match self.not_kept.replace(number) {
            Some(before) if before == number => {
                Err(self.error(NumberedLine::<L>::not_kept(number)))
            }
            _ => self.ask_for_again(self.current),
        }
    }

    /// Has a line sent again, behind the `ok` that acknowledges nothing.
    fn ask_for_again(&mut self, number: u32) -> Result<(), RigError> {
        self.resends += 1;
        if self.resends > MOST_RESENDS {
            return Err(self.error(Cause::RepeatedlyDamaged { times: self.resends }));
        }
        let empty_ok_until = Instant::now() + EMPTY_OK_WITHIN;
        self.resend = Some(Resend { number, empty_ok_until });
        Ok(())
    }

    /// Sends a mark, whose answer shows that all lines before it were taken.
    async fn send_mark(&mut self) -> Result<(), RigError> {
        self.probes += 1;
        self.answer.in_doubt = true;
        self.marked = Some(false);
        let probe = self.line.probe();
        self.send_new(&probe).await
    }

    fn take_position(&mut self, position: RobotPosition) {
        if self.proof == Proof::Report && self.current == self.last {
            self.answer.position = Some(position);
        } else if self.line.echoes_marks == Some(false) {
            self.marked = self.marked.map(|_| true);
        }
    }

    /// The query in its plain form takes the place of the one refused.
    async fn take_unknown_query(&mut self, received: &str) -> Result<(), RigError> {
        if self.line.position_query == "M114" {
            return Err(self.error(Cause::Refused { reply: received.to_owned() }));
        }
        self.line.position_query = "M114";
        self.send_new("M114").await
    }

    /// Sends a command under the next number.
    async fn send_new(&mut self, command: &str) -> Result<(), RigError> {
        self.last = self.line.number(command)?;
        self.send(self.last).await
    }

    /// Sends a line that has a number; its answer is expected next.
    async fn send(&mut self, number: u32) -> Result<(), RigError> {
        self.current = number;
        self.line.write(number).await
    }

    fn error(&self, cause: Cause) -> RigError {
        self.line.wire.error(cause)
    }
}
