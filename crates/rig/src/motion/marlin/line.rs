//! Lines as the firmware takes them: numbered, with a checksum, never cut.

use crate::error::Cause;

/// Marlin cuts longer lines in silence and answers `ok`, characters.
const LONGEST: usize = 96;

/// `N<number> <command>*<checksum>` and the line end.
///
/// The checksum is the exclusive or of all bytes before the `*`, in decimal.
///
/// # Errors
/// [`Cause::LineTooLong`] for a line that would be cut.
pub(super) fn numbered(number: u32, command: &str) -> Result<String, Cause> {
    let body = format!("N{number} {command}");
    let checksum = body.bytes().fold(0, |sum, byte| sum ^ byte);
    let line = format!("{body}*{checksum}");
    if line.len() > LONGEST {
        return Err(Cause::LineTooLong { length: line.len(), most: LONGEST });
    }
    Ok(line + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_known_from_published_sessions() {
        // As printed by any host that opens a session: `N0 M110 N0*125`.
        assert_eq!(numbered(0, "M110 N0").expect("short"), "N0 M110 N0*125\n");
    }

    #[test]
    fn a_line_that_would_be_cut_is_not_sent() {
        for length in 80..110 {
            match numbered(1, &"X".repeat(length)) {
                Ok(line) => assert!(line.trim_end().len() <= LONGEST),
                Err(cause) => {
                    assert!(matches!(cause, Cause::LineTooLong { length, .. } if length > LONGEST))
                }
            }
        }
        assert!(numbered(1, &"X".repeat(LONGEST)).is_err());
    }
}
