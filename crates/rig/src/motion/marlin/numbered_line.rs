//! Numbered lines to one firmware, and what is known of its build.

use std::collections::VecDeque;
use std::time::Duration;

use super::line::numbered;
use super::reply::MARK;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};

/// Lines kept for a resend. One is under way at a time, and probes behind it.
const KEPT_LINES: usize = 8;

/// The line to a firmware: numbers given, lines kept for a resend, and how this build answers.
#[derive(Debug)]
pub(super) struct NumberedLine<L> {
    pub(super) wire: Wire<L>,
    next: u32,
    sent: VecDeque<(u32, String)>,
    /// Whether this build has reported that it is busy, so that its silence means something.
    pub(super) reports_busy: bool,
    pub(super) position_query: &'static str,
    /// The last mark; no two are alike.
    pub(super) mark: u32,
    /// Whether this build echoes marks; not known before the first exchange.
    pub(super) echoes_marks: Option<bool>,
    /// The words with which the firmware has halted: it stands still and answers nothing until its power is cycled.
    pub(super) halted: Option<String>,
}

impl<L: ByteLink> NumberedLine<L> {
    pub(super) fn new(wire: Wire<L>) -> Self {
        Self {
            wire,
            next: 1,
            sent: VecDeque::new(),
            reports_busy: false,
            // The true position in builds that have it; the others ignore the letter.
            position_query: "M114 R",
            mark: 0,
            echoes_marks: None,
            halted: None,
        }
    }

    /// That the firmware has halted, with its words.
    pub(super) fn halted(&mut self, reply: String) -> RigError {
        self.halted = Some(reply.clone());
        self.wire.error(Cause::Halted { reply })
    }

    /// That nothing was answered: by a firmware that was seen to halt, for that reason.
    pub(super) fn silent(&self, waited: Duration) -> RigError {
        self.wire.error(match self.halted.clone() {
            Some(reply) => Cause::Halted { reply },
            None => Cause::Silent { waited },
        })
    }

    /// Counts from 1 again, as a firmware does that was told `M110 N0`.
    pub(super) fn restart(&mut self) {
        self.sent.clear();
        self.next = 1;
    }

    /// A command whose answer shows that all before it was executed: a mark not used before in this session, or a position
    /// query where the build does not echo marks.
    pub(super) fn probe(&mut self) -> String {
        if self.echoes_marks == Some(false) {
            return self.position_query.to_owned();
        }
        self.mark = self.mark.wrapping_add(1);
        format!("M118 {MARK}{}", self.mark)
    }

    /// Gives a command the next number and keeps it for a resend.
    pub(super) fn number(&mut self, command: &str) -> Result<u32, RigError> {
        let number = self.next;
        let line = numbered(number, command).map_err(|cause| self.wire.error(cause))?;
        self.sent.push_back((number, line));
        if self.sent.len() > KEPT_LINES {
            self.sent.pop_front();
        }
        self.next += 1;
        Ok(number)
    }

    /// Sends the line with a number, for the first time or again.
    pub(super) async fn write(&mut self, number: u32) -> Result<(), RigError> {
        let line = self.sent.iter().find(|(sent, _)| *sent == number).map(|(_, line)| line.clone());
        match line {
            Some(line) => self.wire.send(line.as_bytes()).await,
            None => Err(self.wire.error(Cause::LineNotKept { wanted: number })),
        }
    }

    /// Whether the line with a number can be sent again.
    pub(super) fn keeps(&self, number: u32) -> bool {
        self.sent.iter().any(|(sent, _)| *sent == number)
    }

    /// Whether the firmware's complaint of an unknown command repeats the line with a number, with or without the number.
    pub(super) fn repeats(&self, number: u32, complaint: &str) -> bool {
        let line =
            self.sent.iter().find(|(sent, _)| *sent == number).map(|(_, line)| line.as_str());
        let numbered =
            line.and_then(|line| line.rsplit_once('*')).map_or("", |(numbered, _)| numbered);
        let command = numbered.split_once(' ').map_or("", |(_, command)| command);
        let repeated =
            complaint.split_once('"').map_or("", |(_, repeated)| repeated.trim_end_matches('"'));
        !repeated.is_empty() && (repeated == command || repeated == numbered)
    }

    /// That the firmware asks for a line that is not kept.
    pub(super) fn not_kept(wanted: u32) -> Cause {
        // A firmware that restarted counts from the beginning, even if its `start` was lost.
        if wanted <= 1 { Cause::Reset } else { Cause::LineNotKept { wanted } }
    }
}
