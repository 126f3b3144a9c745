//! Lines as the firmware takes them: never cut, never with a byte that acts on its own.

use crate::error::Cause;
use crate::space::{Feed, RobotPosition};

/// The longest line that GRBL takes whole, characters (its line buffer of 80 holds a terminator too).
const LONGEST: usize = 79;

/// Bytes that act at once, wherever in a line they stand.
const REALTIME: [u8; 3] = *b"?!~";

/// Restarts the firmware; its position is kept if it stands still, and it greets.
pub(super) const SOFT_RESET: &[u8] = &[0x18];

/// Asks for a status report.
pub(super) const STATUS_QUERY: &[u8] = b"?";

/// Sets the feed override back to 100 %. A realtime byte: sent by itself.
pub(super) const FEED_OVERRIDE_100: &[u8] = &[0x90];

/// A dwell of nothing, which waits for all motion before it.
pub(super) const SYNC: &str = "G4P0";

/// A line that may be sent: printable ASCII, short enough.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line(String);

impl Line {
    /// Takes `text` for a line.
    ///
    /// # Errors
    /// [`Cause::LineTooLong`] for one that would be cut.
    ///
    /// # Panics
    /// On a byte that acts at once: no caller makes one.
    pub(super) fn new(text: &str) -> Result<Self, Cause> {
        assert!(
            text.bytes().all(|byte| matches!(byte, b' '..=b'~') && !REALTIME.contains(&byte)),
            "`{text}` holds a byte that would act at once"
        );
        if text.len() > LONGEST {
            return Err(Cause::LineTooLong { length: text.len(), most: LONGEST });
        }
        Ok(Self(format!("{text}\n")))
    }

    /// A straight move in the machine's coordinates. It states everything, so that earlier commands do
    /// not matter and it may be sent again.
    ///
    /// # Errors
    /// [`Cause::LineTooLong`] for absurd numbers.
    pub(super) fn straight_to(target: RobotPosition, feed: Feed) -> Result<Self, Cause> {
        let [x, y, z] = target.axes_mm();
        Self::new(&format!("G21G90G94G53G1X{x:.3}Y{y:.3}Z{z:.3}F{:.1}", feed.mm_min()))
    }

    /// The bytes, with the line end.
    pub(super) fn bytes(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use fieldgap_input::Positive;

    fn feed(mm_s: f64) -> Feed {
        Feed::from_mm_s(Positive::new(mm_s).expect("positive"))
    }

    #[test]
    fn a_move_names_units_frame_and_feed() {
        let target = RobotPosition::from_axes_mm([-150.0, -0.5, -12.3456]);
        let line = Line::straight_to(target, feed(80.0)).expect("short");
        assert_eq!(line.bytes(), b"G21G90G94G53G1X-150.000Y-0.500Z-12.346F4800.0\n");
    }

    #[test]
    fn a_line_that_would_be_cut_is_not_sent() {
        assert!(Line::new(&"X".repeat(LONGEST)).is_ok());
        let cause = Line::new(&"X".repeat(LONGEST + 1)).expect_err("too long");
        assert!(matches!(cause, Cause::LineTooLong { length: 80, most: 79 }));
    }

    proptest! {
        #[test]
        fn no_move_holds_a_byte_that_acts_at_once(
            at in prop::array::uniform3(-1e4..1e4f64), mm_s in 0.1..1e4f64,
        ) {
            if let Ok(line) = Line::straight_to(RobotPosition::from_axes_mm(at), feed(mm_s)) {
                let bytes = line.bytes();
                prop_assert!(bytes.len() <= LONGEST + 1);
                prop_assert!(bytes[..bytes.len() - 1].iter().all(|&b| (b' '..0x7f).contains(&b) && !REALTIME.contains(&b)));
            }
        }
    }
}
