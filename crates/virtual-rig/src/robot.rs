//! The virtual robot: its firmware and settings.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

use serde::Deserialize;

use super::firmware::Firmware;
use super::grbl_firmware::{Dialect, GrblFirmware, GrblSettings};
use super::marlin_firmware::{MarlinFirmware, MarlinSettings};
use super::trajectory::Trajectory;
use fieldgap_input::{Exact, Gap, Length, Positive};

/// `[virtual.robot]`: `firmware = "marlin"` (the default), `"grbl"` or `"grblhal"`, and the keys of that firmware.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "RobotKeys")]
pub enum RobotSettings {
    /// Marlin 2.1.
    Marlin(MarlinSettings),
    /// GRBL 1.1 or grblHAL.
    Grbl(Dialect, GrblSettings),
}

#[derive(Deserialize)]
struct RobotKeys {
    #[serde(default)]
    firmware: FirmwareName,
    #[serde(flatten)]
    settings: toml::Table,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FirmwareName {
    #[default]
    Marlin,
    Grbl,
    GrblHal,
}

impl TryFrom<RobotKeys> for RobotSettings {
    type Error = toml::de::Error;
    fn try_from(RobotKeys { firmware, settings }: RobotKeys) -> Result<Self, Self::Error> {
        Ok(match firmware {
            FirmwareName::Marlin => Self::Marlin(settings.try_into()?),
            FirmwareName::Grbl => Self::Grbl(Dialect::Grbl, settings.try_into()?),
            FirmwareName::GrblHal => Self::Grbl(Dialect::GrblHal, settings.try_into()?),
        })
    }
}

impl Default for RobotSettings {
    fn default() -> Self {
        Self::Marlin(MarlinSettings::default())
    }
}

impl RobotSettings {
    /// Travel of each axis from its switch.
    pub fn travel_mm(&self) -> Exact<Length, 3> {
        match self {
            Self::Marlin(settings) => settings.travel_mm,
            Self::Grbl(_, settings) => settings.travel_mm,
        }
    }

    /// Position of the tool head at power-up, from its switches.
    pub fn parked_mm(&self) -> Exact<Gap, 3> {
        match self {
            Self::Marlin(settings) => settings.parked_mm,
            Self::Grbl(_, settings) => settings.parked_mm,
        }
    }

    /// Acceleration of every axis, mm/s².
    pub fn acceleration_mm_s2(&self) -> Positive {
        match self {
            Self::Marlin(settings) => settings.acceleration_mm_s2,
            Self::Grbl(_, settings) => settings.acceleration_mm_s2,
        }
    }

    /// Position of the robot's zero after homing, from the switches, mm.
    pub fn zero_mm(&self) -> [f64; 3] {
        match self {
            Self::Marlin(_) => [0.0; 3],
            Self::Grbl(_, settings) => settings.machine_zero_mm(),
        }
    }

    /// The firmware, driving the tool head of `trajectory`.
    pub(super) fn firmware(
        &self,
        trajectory: Arc<Mutex<Trajectory>>,
        homing_jam: Arc<AtomicBool>,
    ) -> Box<dyn Firmware> {
        match *self {
            Self::Marlin(settings) => {
                Box::new(MarlinFirmware::new(settings, trajectory, homing_jam))
            }
            Self::Grbl(dialect, settings) => {
                Box::new(GrblFirmware::new(settings, dialect, trajectory, homing_jam))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::{Fault, toml_text};

    fn robot(text: &str) -> Result<RobotSettings, Fault> {
        #[derive(Debug, Deserialize)]
        struct File {
            robot: RobotSettings,
        }
        toml_text::<File>(Path::new("rig.toml"), text).map(|file| file.robot)
    }

    #[test]
    fn each_firmware_has_keys_of_its_own() {
        let marlin = robot("[robot]\nadvanced_ok = true\n").expect("valid");
        assert!(matches!(marlin, RobotSettings::Marlin(settings) if settings.advanced_ok));
        let hal = robot("[robot]\nfirmware = \"grblhal\"\nidle_ms = 255\n").expect("valid");
        assert!(matches!(hal, RobotSettings::Grbl(Dialect::GrblHal, s) if s.idle_ms == 255));
        assert_eq!(hal.zero_mm(), [300.0, 300.0, 250.0]);
        for wrong in
            ["firmware = \"grbl\"\nadvanced_ok = true", "firmware = \"gerbil\"", "idle_ms = 255"]
        {
            let fault = robot(&format!("[robot]\n{wrong}\n")).expect_err("wrong");
            assert!(fault.line_column().is_some(), "{fault}");
        }
    }
}
