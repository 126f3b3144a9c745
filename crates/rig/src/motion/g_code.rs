//! The lines of G-code that Marlin and Klipper share, and how long their moves may take.

use std::time::Duration;

use serde::Deserialize;

use super::limits::Slack;
use crate::space::{Feed, RobotPosition};

/// Beyond its length over its feed: axes may have a lower limit of their own, accelerate, and wait for other work of the
/// firmware.
pub(super) const MOVE_SLACK: Slack = Slack { factor: 20.0, extra: Duration::from_secs(60) };

/// A straight move at a speed.
pub(super) fn straight_to(target: RobotPosition, feed: Feed) -> String {
    let [x, y, z] = target.axes_mm();
    format!("G1 X{x:.3} Y{y:.3} Z{z:.3} F{:.1}", feed.mm_min())
}

/// A `G28` line: homing and nothing else.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct HomeLine(String);

impl Default for HomeLine {
    fn default() -> Self {
        Self("G28".to_owned())
    }
}

impl HomeLine {
    /// The line as it is sent.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for HomeLine {
    type Error = String;
    fn try_from(line: String) -> Result<Self, String> {
        let mut words = line.split(' ');
        let axes_only =
            words.next() == Some("G28") && words.all(|word| matches!(word, "X" | "Y" | "Z"));
        if axes_only {
            Ok(Self(line))
        } else {
            Err(format!("`{line}` is not a homing line such as `G28` or `G28 X Y`"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_homing_may_be_asked_for_under_home() {
        for good in ["G28", "G28 Z", "G28 X Y"] {
            assert!(HomeLine::try_from(good.to_owned()).is_ok(), "{good}");
        }
        for bad in ["", "G1 X10", "G28 X\nG1 X10", "g28", "G28 X10", "G280"] {
            assert!(HomeLine::try_from(bad.to_owned()).is_err(), "{bad}");
        }
    }
}
