//! From bytes to accepted commands: line ends, comments, length, line numbers and checksums.

/// An accepted command.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Accepted {
    /// The command without number, checksum, comment and outer blanks.
    pub text: String,
    /// Its line number, where it had one.
    pub number: Option<i64>,
}

/// How a line is treated.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Verdict {
    /// To be executed.
    Accepted(Accepted),
    /// Blank, or a repeat of one of the last two accepted numbers: dropped without a message.
    Dropped,
    /// A transmission error: this text is reported, and the line after the last good one is requested again.
    Refused(&'static str),
}

/// The reader of lines.
#[derive(Debug)]
pub(super) struct LineIntake {
    line: Vec<u8>,
    in_comment: bool,
    limit: usize,
    last_number: i64,
}

impl LineIntake {
    /// A reader that keeps at most `line_length - 1` characters of a line.
    pub fn new(line_length: usize) -> Self {
        Self {
            line: Vec::new(),
            in_comment: false,
            limit: line_length.saturating_sub(1),
            last_number: 0,
        }
    }

    /// The number of the last accepted line.
    pub fn last_number(&self) -> i64 {
        self.last_number
    }

    /// Sets the number of the last accepted line (`M110`).
    pub fn set_last_number(&mut self, number: i64) {
        self.last_number = number;
    }

    /// Takes one byte; at the end of a line, returns how it is treated.
    pub fn byte(&mut self, byte: u8) -> Option<Verdict> {
        match byte {
            b'\n' | b'\r' => {
                self.in_comment = false;
                let line = std::mem::take(&mut self.line);
                Some(self.judge(&line))
            }
            _ if self.in_comment => None,
            b';' => {
                self.in_comment = true;
                None
            }
            // What does not fit is cut in silence.
            _ => {
                if self.line.len() < self.limit {
                    self.line.push(byte);
                }
                None
            }
        }
    }

    fn judge(&mut self, line: &[u8]) -> Verdict {
        let line = trim_start(line);
        if line.is_empty() {
            return Verdict::Dropped;
        }
        if line[0] != b'N' {
            return Verdict::Accepted(Accepted { text: command_text(line), number: None });
        }
        let sets_number = line.windows(4).position(|window| window == b"M110");
        // In `N5 M110 N9` the second number counts.
        let number_at = match sets_number {
            Some(at) => line[at..].iter().position(|&b| b == b'N').map_or(0, |n| at + n),
            None => 0,
        };
        let (number, _) = integer(&line[number_at + 1..]);
        if number != self.last_number.wrapping_add(1) && sets_number.is_none() {
            let repeat = number == self.last_number || number == self.last_number.wrapping_sub(1);
            return match repeat {
                true => Verdict::Dropped,
                false => Verdict::Refused("Line Number is not Last Line Number+1, Last Line: "),
            };
        }
        let Some(star) = line.iter().rposition(|&b| b == b'*') else {
            return Verdict::Refused("No Checksum with line number, Last Line: ");
        };
        let sum = line[..star].iter().fold(0u8, |sum, &b| sum ^ b);
        if integer(&line[star + 1..]).0 != i64::from(sum) {
            return Verdict::Refused("checksum mismatch, Last Line: ");
        }
        self.last_number = number;
        let (_, digits) = integer(&line[1..]);
        Verdict::Accepted(Accepted {
            text: command_text(&line[1 + digits..star]),
            number: Some(number),
        })
    }
}

fn command_text(line: &[u8]) -> String {
    let end = line.iter().position(|&b| b == b'*').unwrap_or(line.len());
    String::from_utf8_lossy(&line[..end]).trim().to_owned()
}

fn trim_start(line: &[u8]) -> &[u8] {
    let blanks = line.iter().take_while(|&&b| b == b' ').count();
    &line[blanks..]
}

/// The decimal integer at the start of `bytes` (0 if there is none), and the number of bytes it takes.
fn integer(bytes: &[u8]) -> (i64, usize) {
    let blanks = bytes.len() - trim_start(bytes).len();
    let bytes = trim_start(bytes);
    let (sign, skip) = match bytes.first() {
        Some(b'-') => (-1i64, 1),
        _ => (1, 0),
    };
    let digits = bytes[skip..].iter().take_while(|b| b.is_ascii_digit()).count();
    let value = bytes[skip..skip + digits]
        .iter()
        .fold(0i64, |value, &b| value.saturating_mul(10).saturating_add(i64::from(b - b'0')));
    (sign.saturating_mul(value), blanks + skip + digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feed(intake: &mut LineIntake, text: &str) -> Vec<Verdict> {
        text.bytes().filter_map(|byte| intake.byte(byte)).collect()
    }

    fn numbered(number: i64, command: &str) -> String {
        let line = format!("N{number} {command}");
        let sum = line.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("{line}*{sum}\n")
    }

    fn accepted(text: &str, number: Option<i64>) -> Verdict {
        Verdict::Accepted(Accepted { text: text.to_owned(), number })
    }

    #[test]
    fn numbers_and_checksums_are_stripped_from_a_good_line() {
        let mut intake = LineIntake::new(96);
        assert_eq!(feed(&mut intake, &numbered(1, "G28")), [accepted("G28", Some(1))]);
        assert_eq!(feed(&mut intake, "M114 ; where?\n"), [accepted("M114", None)]);
    }

    #[test]
    fn a_repeat_of_either_of_the_last_two_numbers_is_dropped_unread() {
        let mut intake = LineIntake::new(96);
        for n in 1..=3 {
            feed(&mut intake, &numbered(n, "M114"));
        }
        assert_eq!(feed(&mut intake, &numbered(3, "G28")), [Verdict::Dropped]);
        assert_eq!(feed(&mut intake, "N2 garbled*0\n"), [Verdict::Dropped]);
        assert!(matches!(feed(&mut intake, &numbered(1, "G28"))[..], [Verdict::Refused(_)]));
        assert_eq!(intake.last_number(), 3);
    }

    #[test]
    fn a_skipped_line_a_bad_and_a_missing_checksum_are_refused() {
        for bad in [numbered(2, "G28"), "N1 G28*1\n".into(), "N1 G28\n".into()] {
            let mut intake = LineIntake::new(96);
            assert!(matches!(feed(&mut intake, &bad)[..], [Verdict::Refused(_)]), "{bad}");
        }
    }

    #[test]
    fn m110_is_accepted_with_any_number_and_its_own_counts() {
        let mut intake = LineIntake::new(96);
        feed(&mut intake, &numbered(77, "M110"));
        assert_eq!(intake.last_number(), 77);
        feed(&mut intake, &numbered(0, "M110 N5"));
        assert_eq!(intake.last_number(), 5);
    }

    #[test]
    fn a_line_longer_than_the_buffer_loses_its_end() {
        let mut intake = LineIntake::new(96);
        let line = format!("M117 {}\n", "x".repeat(200));
        let verdicts = feed(&mut intake, &line);
        assert!(matches!(&verdicts[..], [Verdict::Accepted(a)] if a.text.len() == 95));
    }
}
