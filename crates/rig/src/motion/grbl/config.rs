//! `[motion.grbl]`

use serde::Deserialize;

use crate::motion::firmware_table::{FirmwareKeys, firmware_table};

firmware_table! {
    /// `[motion.grbl]`: where the firmware is reached and how it homes.
    ///
    /// `$H` homes z first. Single axes (`home = ["$HZ", "$HX", "$HY"]`) are an option of some builds. Where the firmware's
    /// settings give homing less time than `home_within_s`, theirs applies.
    GrblConfig homes by HomingCommand {
        /// Whether the motors are to hold at rest. If they do not (`$1` below 255), `$1=255` is written, which the
        /// firmware keeps. With `false` nothing is written, and a warning explains the consequence.
        hold_motors: bool = true,
    }
}

/// `$H`, or one axis of it: homing and nothing else.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct HomingCommand(String);

impl Default for HomingCommand {
    fn default() -> Self {
        Self("$H".to_owned())
    }
}

impl HomingCommand {
    /// The command as it is sent.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for HomingCommand {
    type Error = String;
    fn try_from(command: String) -> Result<Self, String> {
        if matches!(command.as_str(), "$H" | "$HX" | "$HY" | "$HZ") {
            Ok(Self(command))
        } else {
            Err(format!("`{command}` is not a homing command; they are `$H`, `$HX`, `$HY`, `$HZ`"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_homing_may_be_asked_for_under_home() {
        for good in ["$H", "$HX", "$HZ"] {
            assert!(HomingCommand::try_from(good.to_owned()).is_ok(), "{good}");
        }
        for bad in ["", "$X", "$h", "$HA", "$H\nG1X1", "G28"] {
            assert!(HomingCommand::try_from(bad.to_owned()).is_err(), "{bad}");
        }
    }
}
