//! From bytes to lines: the receive buffer, real-time bytes, and characters that are dropped from a line.

use std::collections::VecDeque;

/// A real-time byte, which acts at once, before any waiting line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Realtime {
    /// `0x18`
    Reset,
    /// `?`
    Report,
    /// `!`
    Hold,
    /// `~`
    Resume,
    /// `0x84`
    Door,
    /// `0x85`
    CancelJog,
    /// `0x90` to `0x9d`: a change of the feed override.
    Override(Override),
    /// Any other byte from `0x80` on: dropped.
    Nothing,
}

/// A change of the feed override.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Override {
    /// Back to 100 %.
    Normal,
    /// By so many percent.
    By(i32),
}

/// How a line is treated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Taken {
    /// To be executed; may be empty.
    Line(String),
    /// Longer than the line buffer: `error:11`.
    TooLong,
}

/// The serial receiver and the reader of lines.
#[derive(Debug)]
pub(super) struct Intake {
    buffer: VecDeque<u8>,
    capacity: usize,
    line: String,
    longest: usize,
    too_long: bool,
    comment: Option<u8>,
}

impl Intake {
    /// A receive buffer of so many bytes, and lines of at most `longest` characters.
    pub fn new(capacity: usize, longest: usize) -> Self {
        Self {
            buffer: VecDeque::new(),
            capacity,
            line: String::new(),
            longest,
            too_long: false,
            comment: None,
        }
    }

    /// Drops all received bytes.
    pub fn clear(&mut self) {
        *self = Self::new(self.capacity, self.longest);
    }

    /// Free bytes of the buffer.
    pub fn free(&self) -> usize {
        self.capacity - self.buffer.len()
    }

    /// Receives one byte. It is lost without an error if the buffer is full.
    pub fn receive(&mut self, byte: u8) -> Option<Realtime> {
        let acts = match byte {
            0x18 => Realtime::Reset,
            b'?' => Realtime::Report,
            b'!' => Realtime::Hold,
            b'~' => Realtime::Resume,
            0x84 => Realtime::Door,
            0x85 => Realtime::CancelJog,
            0x90 => Realtime::Override(Override::Normal),
            0x91 => Realtime::Override(Override::By(10)),
            0x92 => Realtime::Override(Override::By(-10)),
            0x93 => Realtime::Override(Override::By(1)),
            0x94 => Realtime::Override(Override::By(-1)),
            0x80.. => Realtime::Nothing,
            _ => {
                if self.buffer.len() < self.capacity {
                    self.buffer.push_back(byte);
                }
                return None;
            }
        };
        Some(acts)
    }

    /// The next whole line, in capitals, without blanks and comments.
    pub fn next_line(&mut self) -> Option<Taken> {
        while let Some(byte) = self.buffer.pop_front() {
            if matches!(byte, b'\n' | b'\r') {
                self.comment = None;
                let line = std::mem::take(&mut self.line);
                return Some(match std::mem::take(&mut self.too_long) {
                    true => Taken::TooLong,
                    false => Taken::Line(line),
                });
            }
            match self.comment {
                Some(b'(') if byte == b')' => self.comment = None,
                Some(_) => {}
                None if byte == b'(' || byte == b';' => self.comment = Some(byte),
                None if byte <= b' ' || byte == b'/' => {}
                None if self.line.len() >= self.longest => self.too_long = true,
                None => self.line.push(char::from(byte).to_ascii_uppercase()),
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feed(intake: &mut Intake, bytes: &[u8]) -> Vec<Realtime> {
        bytes.iter().filter_map(|&byte| intake.receive(byte)).collect()
    }

    #[test]
    fn lines_lose_blanks_and_comments() {
        let mut intake = Intake::new(128, 79);
        feed(&mut intake, b"g1 x10 (there) f600 ; and back\n\r\n");
        assert_eq!(intake.next_line(), Some(Taken::Line("G1X10F600".into())));
        assert_eq!(intake.next_line(), Some(Taken::Line(String::new())));
        assert_eq!(intake.next_line(), Some(Taken::Line(String::new())));
        assert_eq!(intake.next_line(), None);
    }

    #[test]
    fn bytes_that_act_at_once_are_taken_out_of_the_line() {
        let mut intake = Intake::new(128, 79);
        let acted = feed(&mut intake, b"G1?X1!\x90\xff0\n");
        let normal = Realtime::Override(Override::Normal);
        assert_eq!(acted, [Realtime::Report, Realtime::Hold, normal, Realtime::Nothing]);
        assert_eq!(intake.next_line(), Some(Taken::Line("G1X10".into())));
    }

    #[test]
    fn what_overruns_the_buffer_is_lost_and_two_lines_may_become_a_third() {
        let mut intake = Intake::new(8, 79);
        feed(&mut intake, b"G1X10\nG1X20\n");
        assert_eq!(intake.next_line(), Some(Taken::Line("G1X10".into())));
        feed(&mut intake, b"Y30\n");
        assert_eq!(intake.next_line(), Some(Taken::Line("G1Y30".into())));
    }

    #[test]
    fn a_line_longer_than_its_buffer_is_one_error() {
        let mut intake = Intake::new(300, 79);
        feed(&mut intake, &[b'X'; 90]);
        feed(&mut intake, b"\nG4P0\n");
        assert_eq!(intake.next_line(), Some(Taken::TooLong));
        assert_eq!(intake.next_line(), Some(Taken::Line("G4P0".into())));
    }
}
