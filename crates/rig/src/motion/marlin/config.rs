//! `[motion.marlin]`

use serde::Deserialize;

use fieldgap_input::Positive;

/// `[motion.marlin]`: where the firmware is reached and how it homes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarlinConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// The lines that home the robot, in order. The path of homing is the firmware's own, so no
    /// keep-out box is checked on it: where something stands in the way, home the axis that
    /// clears it first, for instance `["G28 Z", "G28 X Y"]`.
    #[serde(default = "default_home")]
    pub home: Vec<HomeLine>,
    /// How long homing may take in all, s.
    #[serde(default = "default_home_within_s")]
    pub home_within_s: Positive,
}

impl Default for MarlinConfig {
    fn default() -> Self {
        Self {
            port: None,
            baud: default_baud(),
            home: default_home(),
            home_within_s: default_home_within_s(),
        }
    }
}

fn default_baud() -> u32 {
    115_200
}

fn default_home() -> Vec<HomeLine> {
    vec![HomeLine("G28".to_owned())]
}

fn default_home_within_s() -> Positive {
    Positive::new(180.0).expect("180 is above zero")
}

/// A `G28` line: homing and nothing else.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct HomeLine(String);

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
