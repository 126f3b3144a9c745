//! Commands that act on arrival, before any waiting command.

/// An emergency command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Emergency {
    /// `M112`: everything off until a power cycle.
    Kill,
    /// `M410`: all motion ends at once.
    QuickStop,
}

/// Watches the incoming bytes beside the line reader.
#[derive(Debug, Default)]
pub(super) struct EmergencyParser {
    line: Vec<u8>,
}

/// Longer lines hold no emergency command.
const LONGEST: usize = 32;

impl EmergencyParser {
    /// Takes one byte; at the end of a line returns the emergency command, if it was one.
    pub fn byte(&mut self, byte: u8) -> Option<Emergency> {
        if byte != b'\n' && byte != b'\r' {
            if self.line.len() < LONGEST {
                self.line.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.line);
        let text = std::str::from_utf8(&line).ok()?.trim_start();
        let text = match text.strip_prefix('N') {
            Some(rest) => rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' '),
            None => text,
        };
        match text.split(['*', ' ', ';']).next() {
            Some("M112") => Some(Emergency::Kill),
            Some("M410") => Some(Emergency::QuickStop),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last(text: &str) -> Option<Emergency> {
        let mut parser = EmergencyParser::default();
        text.bytes().fold(None, |last, byte| parser.byte(byte).or(last))
    }

    #[test]
    fn the_two_commands_are_seen_with_or_without_number_and_checksum() {
        assert_eq!(last("M112\n"), Some(Emergency::Kill));
        assert_eq!(last("G1 X1\nN12 M410*33\n"), Some(Emergency::QuickStop));
        assert_eq!(last("M1120\nM4\nM117 M112\n"), None);
    }
}
