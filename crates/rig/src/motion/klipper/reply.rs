//! The host software's replies, line by line.

use crate::space::RobotPosition;

/// What marks begin with: no command of Klipper's does.
pub(super) const MARK: &str = "FIELDGAP_MARK_";

/// One line from the host software.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Reply {
    /// The end of an answer, with what stands behind it on its line.
    Ok(String),
    /// Why a command failed.
    Error(String),
    /// The state of the host software: `Ready`, `Startup`, `Shutdown`, `Disconnect`.
    State(String),
    /// A command that is not known.
    Unknown(String),
    /// The position by the motors' steps.
    Position(RobotPosition),
    /// Anything else.
    Other,
}

impl Reply {
    /// Reads one line, any line.
    pub(super) fn parse(line: &str) -> Self {
        if line == "ok" {
            return Self::Ok(String::new());
        }
        if let Some(behind) = line.strip_prefix("ok ") {
            return Self::Ok(behind.trim().to_owned());
        }
        if let Some(error) = line.strip_prefix("!!") {
            return Self::Error(error.trim().to_owned());
        }
        let Some(note) = line.strip_prefix("// ") else { return Self::Other };
        if let Some(state) = note.strip_prefix("Klipper state: ") {
            return Self::State(state.trim().to_owned());
        }
        if let Some(command) = note.strip_prefix("Unknown command:\"") {
            return Self::Unknown(command.trim_end_matches('"').to_owned());
        }
        note.strip_prefix("kinematic: ")
            .and_then(parse_position)
            .map_or(Self::Other, Self::Position)
    }
}

/// `X:10.000000 Y:20.000000 Z:5.000000`, mm.
fn parse_position(coordinates: &str) -> Option<RobotPosition> {
    let axis = |name: &str| -> Option<f64> {
        let word = coordinates.split_ascii_whitespace().find_map(|word| word.strip_prefix(name))?;
        word.parse().ok().filter(|mm: &f64| mm.is_finite())
    };
    Some(RobotPosition::from_axes_mm([axis("X:")?, axis("Y:")?, axis("Z:")?]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn each_line_of_a_session_is_known() {
        let text = |text: &str| text.to_owned();
        let known = [
            ("ok", Reply::Ok(String::new())),
            (
                "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12.0",
                Reply::Ok(text("FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12.0")),
            ),
            (
                "!! Must home axis first: 10.000 0.000 0.000 [0.000]",
                Reply::Error(text("Must home axis first: 10.000 0.000 0.000 [0.000]")),
            ),
            ("// Klipper state: Shutdown", Reply::State(text("Shutdown"))),
            ("// Unknown command:\"FIELDGAP_MARK_7\"", Reply::Unknown(text("FIELDGAP_MARK_7"))),
            (
                "// kinematic: X:1.500000 Y:-2.000000 Z:0.000000",
                Reply::Position(RobotPosition::from_axes_mm([1.5, -2.0, 0.0])),
            ),
            ("// toolhead: X:1.500000 Y:-2.000000 Z:0.000000 E:0.000000", Reply::Other),
            ("// kinematic: X:1.5 Y:nan Z:0", Reply::Other),
            ("X:0.000 Y:0.000 Z:0.000 E:0.000", Reply::Other),
            ("echo: hello", Reply::Other),
            ("okay", Reply::Other),
        ];
        for (line, reply) in known {
            assert_eq!(Reply::parse(line), reply, "{line}");
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_the_parser_panic(line in "(//|!!|ok)? ?(kinematic: X:)?\\PC{0,60}") {
            let _ = Reply::parse(&line);
        }
    }
}
