//! The firmware's replies, line by line.

use crate::space::RobotPosition;

/// What marks begin with.
pub(super) const MARK: &str = "fieldgap-";

/// One line from the firmware.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Reply {
    /// A line was taken. Builds with `ADVANCED_OK` name it.
    Ok { line: Option<u32> },
    /// The line with this number is wanted (again).
    Resend(u32),
    /// The firmware is at work and will answer later.
    Busy,
    /// The firmware has just started.
    Started,
    /// The firmware has stopped for good.
    Halted,
    /// An axis ran into its end switch.
    EndstopHit,
    /// The command does not exist in this build.
    UnknownCommand,
    /// A mark is echoed.
    Mark(u32),
    /// The position that the firmware reports.
    Position(RobotPosition),
    /// A line was damaged, skipped or unnumbered; a `Resend` follows.
    TransmissionError,
    /// Any other error.
    Error,
    /// Anything else: notes, temperatures, greetings, garbled lines.
    Other,
}

impl Reply {
    /// Reads one line, any line, that may be two replies: some builds report the position behind its `ok`.
    pub(super) fn all(line: &str) -> Vec<Self> {
        match line.strip_prefix("ok ").and_then(|behind| parse_position(behind.trim_start())) {
            Some(position) => vec![Self::Position(position), Self::Ok { line: None }],
            None => vec![Self::parse(line)],
        }
    }

    /// Reads one line, any line.
    pub(super) fn parse(line: &str) -> Self {
        if let Some(mark) = parse_mark(line) {
            return Self::Mark(mark);
        }
        let mut words = line.split_ascii_whitespace();
        let first = words.next().unwrap_or("");
        if first == "ok" {
            let number = words.next().and_then(|word| word.strip_prefix('N'));
            return Self::Ok { line: number.and_then(|digits| digits.parse().ok()) };
        }
        if let Some(number) = line.strip_prefix("Resend:").or_else(|| line.strip_prefix("rs ")) {
            return number.trim().parse().map_or(Self::Other, Self::Resend);
        }
        if line == "start" {
            return Self::Started;
        }
        if let Some(error) = line.strip_prefix("Error:") {
            return Self::parse_error(error);
        }
        if let Some(note) = line.strip_prefix("echo:") {
            return match note {
                note if note.starts_with("busy:") => Self::Busy,
                note if note.starts_with("endstops hit:") => Self::EndstopHit,
                note if note.starts_with("Unknown command:") => Self::UnknownCommand,
                _ => Self::Other,
            };
        }
        parse_position(line).map_or(Self::Other, Self::Position)
    }

    fn parse_error(error: &str) -> Self {
        let error = error.to_ascii_lowercase();
        if error.contains("kill() called") || error.contains("printer halted") {
            Self::Halted
        } else if ["checksum", "line number", "expected line", "last line"]
            .iter()
            .any(|words| error.contains(words))
        {
            Self::TransmissionError
        } else {
            Self::Error
        }
    }
}

/// `fieldgap-12`, or the complaint of a build without `M118`: `echo:Unknown command: "M118 fieldgap-12"`.
fn parse_mark(line: &str) -> Option<u32> {
    let line = line.strip_prefix("echo:").unwrap_or(line);
    let line = line.strip_prefix("Unknown command: \"M118 ").unwrap_or(line);
    line.strip_prefix(MARK)?.trim_end_matches('"').parse().ok()
}

/// `X:10.00 Y:20.00 Z:5.00 E:0.00 Count X:800 Y:1600 Z:2000`, millimetres; builds differ in their spaces.
///
/// What follows `Count` is the same target in motor steps and adds nothing.
fn parse_position(line: &str) -> Option<RobotPosition> {
    if !line.starts_with("X:") {
        return None;
    }
    let coordinates = line.split("Count").next()?;
    let axis = |name: &str| -> Option<f64> {
        let (_, after) = coordinates.split_once(name)?;
        let after = after.trim_start();
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
        let end = after.find(|c| !is_number(c)).unwrap_or(after.len());
        after[..end].parse().ok().filter(|mm: &f64| mm.is_finite())
    };
    Some(RobotPosition::from_axes_mm([axis("X:")?, axis("Y:")?, axis("Z:")?]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_line_of_a_session_is_known() {
        let known = [
            ("ok", Reply::Ok { line: None }),
            ("ok N7 P15 B3", Reply::Ok { line: Some(7) }),
            ("ok T:20.0 /0.0", Reply::Ok { line: None }),
            ("Resend: 12", Reply::Resend(12)),
            ("Resend:12", Reply::Resend(12)),
            ("rs 12", Reply::Resend(12)),
            ("echo:busy: processing", Reply::Busy),
            ("start", Reply::Started),
            ("Error:Printer halted. kill() called!", Reply::Halted),
            ("Error:checksum mismatch, Last Line: 4", Reply::TransmissionError),
            ("Error:Line Number is not Last Line Number+1, Last Line: 4", Reply::TransmissionError),
            ("Error:No Checksum with line number, Last Line: 4", Reply::TransmissionError),
            ("Error: expected line 5 got 7", Reply::TransmissionError),
            ("Error:cjecksum mismatch, Last Line: 4", Reply::TransmissionError),
            ("Error:MINTEMP triggered, system stopped!", Reply::Error),
            ("echo:endstops hit:  X:-30.00", Reply::EndstopHit),
            ("echo:Unknown command: \"M114 R\"", Reply::UnknownCommand),
            ("echo:  G21    ; Units in mm (mm)", Reply::Other),
            ("fieldgap-12", Reply::Mark(12)),
            ("echo:Unknown command: \"M118 fieldgap-12\"", Reply::Mark(12)),
            ("echo:fieldgap-12", Reply::Mark(12)),
            ("fieldgap-1#", Reply::Other),
            ("wait", Reply::Other),
            ("okk", Reply::Other),
            ("Resend: x", Reply::Other),
            ("started", Reply::Other),
        ];
        for (line, reply) in known {
            assert_eq!(Reply::parse(line), reply, "{line}");
        }
    }

    #[test]
    fn a_position_is_read_with_and_without_spaces() {
        let expected = RobotPosition::from_axes_mm([10.0, -20.5, 5.25]);
        for line in [
            "X:10.00 Y:-20.50 Z:5.25 E:0.00 Count X:800 Y:1600 Z:2000",
            "X:10.00Y:-20.50Z:5.25E:0.00 Count X: 800Y:1600Z:2000",
            "X:10.00 Y:-20.50 Z:5.25",
        ] {
            assert_eq!(Reply::parse(line), Reply::Position(expected), "{line}");
        }
    }

    #[test]
    fn a_position_behind_an_ok_is_both() {
        let at = RobotPosition::from_axes_mm([1.0, 0.5, 0.0]);
        let both = [Reply::Position(at), Reply::Ok { line: None }];
        assert_eq!(Reply::all("ok X:1.0 Y:0.5 Z:0.0 E:0.0 Count: A:0 B:0 C:0"), both);
        assert_eq!(Reply::all("ok N7 P15 B3"), [Reply::Ok { line: Some(7) }]);
    }

    #[test]
    fn a_cut_position_is_none() {
        for line in
            ["X:10.00 Y:20", "X:10.00 Y:20.00 Z:", "X:1.2.3 Y:1 Z:1", "X: Count X:1 Y:1 Z:1"]
        {
            assert_eq!(Reply::parse(line), Reply::Other, "{line}");
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_the_parser_panic(line in "\\PC{0,60}") {
            let _ = Reply::parse(&line);
        }

        #[test]
        fn no_line_made_of_known_pieces_makes_the_parser_panic(
            pieces in proptest::collection::vec(
                prop::sample::select(vec!["ok", " N", "X:", "Y:", "Z:", "Count", "Error:", "echo:", "Resend:", "1.5", "-", "λ"]),
                0..12,
            )
        ) {
            let _ = Reply::parse(&pieces.concat());
        }
    }
}
