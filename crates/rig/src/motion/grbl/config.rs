//! `[motion.grbl]`

use serde::Deserialize;

use fieldgap_input::Positive;

/// `[motion.grbl]`: where the firmware is reached and how it homes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GrblConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// The commands that home the robot, in order. The path of homing is the firmware's own, so no keep-out box is
    /// checked on it; `$H` homes z first. Single axes (`["$HZ", "$HX", "$HY"]`) are an option of some builds.
    #[serde(default = "default_home")]
    pub home: Vec<HomingCommand>,
    /// How long homing may take in all, s. What the firmware's settings make of it is taken where that is less.
    #[serde(default = "default_home_within_s")]
    pub home_within_s: Positive,
    /// Whether the motors are to hold at rest. If they do not (`$1` below 255), `$1=255` is written, which the
    /// firmware keeps. With `false` nothing is written, and a warning says what that means.
    #[serde(default = "default_hold_motors")]
    pub hold_motors: bool,
}

impl Default for GrblConfig {
    fn default() -> Self {
        Self {
            port: None,
            baud: default_baud(),
            home: default_home(),
            home_within_s: default_home_within_s(),
            hold_motors: default_hold_motors(),
        }
    }
}

fn default_baud() -> u32 {
    115_200
}

fn default_home() -> Vec<HomingCommand> {
    vec![HomingCommand("$H".to_owned())]
}

fn default_home_within_s() -> Positive {
    Positive::new(180.0).expect("180 is above zero")
}

fn default_hold_motors() -> bool {
    true
}

/// `$H`, or one axis of it: homing and nothing else.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct HomingCommand(String);

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
