//! The firmware's replies, line by line.

use super::status::Status;
use crate::motion::firmware::Firmware;

/// One line from the firmware.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Reply {
    /// The oldest unanswered line was taken.
    Ok,
    /// The oldest unanswered line was refused.
    Error(u32),
    /// It has locked itself.
    Alarm(u32),
    /// It has just started, or was reset.
    Greeting(Flavour),
    /// A status report.
    Status(Status),
    /// A setting, `$130=200.000`.
    Setting(u32, f64),
    /// A line of Marlin or Klipper.
    OtherFirmware,
    /// Anything else: messages, build info, garbled lines.
    Other,
}

/// The dialects of GRBL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flavour {
    /// GRBL 1.1 itself.
    Grbl,
    /// grblHAL.
    GrblHal,
}

impl Reply {
    /// Reads one line, any line.
    pub(super) fn parse(line: &str) -> Self {
        if line == "ok" {
            return Self::Ok;
        }
        if let Some(code) = line.strip_prefix("error:") {
            return code.parse().map_or(Self::Other, Self::Error);
        }
        if let Some(code) = line.strip_prefix("ALARM:") {
            return code.parse().map_or(Self::Other, Self::Alarm);
        }
        if let Some(flavour) = greeting(line) {
            return Self::Greeting(flavour);
        }
        if line.starts_with('<') {
            return Status::parse(line).map_or(Self::Other, Self::Status);
        }
        if Firmware::of_line(line).is_some_and(|firmware| firmware != Firmware::Grbl) {
            return Self::OtherFirmware;
        }
        setting(line).unwrap_or(Self::Other)
    }
}

/// The dialect of `Grbl 1.1h ['$' for help]`.
fn greeting(line: &str) -> Option<Flavour> {
    let is_greeting = line.contains(" ['$'");
    let name = line.split(' ').next()?;
    match name {
        "Grbl" if is_greeting => Some(Flavour::Grbl),
        "GrblHAL" if is_greeting => Some(Flavour::GrblHal),
        _ => None,
    }
}

fn setting(line: &str) -> Option<Reply> {
    let (number, value) = line.strip_prefix('$')?.split_once('=')?;
    // Older ones explain the value in brackets behind it.
    let value = value.split(' ').next()?;
    Some(Reply::Setting(number.parse().ok()?, value.parse().ok().filter(|v: &f64| v.is_finite())?))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_line_of_a_session_is_known() {
        let known = [
            ("ok", Reply::Ok),
            ("error:20", Reply::Error(20)),
            ("ALARM:1", Reply::Alarm(1)),
            ("Grbl 1.1h ['$' for help]", Reply::Greeting(Flavour::Grbl)),
            ("GrblHAL 1.1f ['$' or '$HELP' for help]", Reply::Greeting(Flavour::GrblHal)),
            ("$130=200.000", Reply::Setting(130, 200.0)),
            ("$22=1 (homing cycle, bool)", Reply::Setting(22, 1.0)),
            ("start", Reply::OtherFirmware),
            ("echo:Unknown command: \"\u{18}\"", Reply::OtherFirmware),
            ("$J=1", Reply::Other),
            ("[MSG:'$H'|'$X' to unlock]", Reply::Other),
            ("okok", Reply::Other),
            ("error:", Reply::Other),
            ("Grbl", Reply::Other),
            ("<Idle|MPos:0.0#", Reply::Other),
        ];
        for (line, reply) in known {
            assert_eq!(Reply::parse(line), reply, "{line}");
        }
        assert!(matches!(Reply::parse("<Idle|MPos:0.000,0.000,0.000>"), Reply::Status(_)));
    }

    proptest! {
        #[test]
        fn no_line_makes_the_parser_panic(line in "\\PC{0,60}") {
            let _ = Reply::parse(&line);
        }
    }
}
