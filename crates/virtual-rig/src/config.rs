//! The section `[virtual]` of a rig file.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::air_firmware::AirSettings;
use super::answers::AnswerSettings;
use super::array_boards::ArraySettings;
use super::clock::Pace;
use super::receiver_firmware::ReceiverSettings;
use super::robot::RobotSettings;
use fieldgap_input::Positive;
use fieldgap_rig::link::fault_injection::FaultRates;

/// `[virtual]`: a virtual rig in place of real devices.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VirtualConfig {
    /// Seed of all random numbers: the same seed and the same commands give the same readings.
    pub seed: u64,
    /// How virtual time passes.
    pub pace: Pace,
    /// The truth file, plain or sealed, relative to the rig file.
    pub truth: PathBuf,
    /// The robot's mechanics and firmware.
    #[serde(default)]
    pub robot: RobotSettings,
    /// The receiver.
    #[serde(default)]
    pub receiver: ReceiverSettings,
    /// Rates of random faults on the devices' lines, as shares of all lines.
    #[serde(default)]
    pub faults: FaultRates,
    /// How late and in which slices the devices' answers come.
    #[serde(default)]
    pub answers: AnswerSettings,
    /// The air sensor, if any.
    pub environment: Option<AirSettings>,
    /// The array's controller.
    #[serde(default)]
    pub array: ArraySettings,
}

impl VirtualConfig {
    /// The truth file, for a rig file in `folder`.
    pub fn truth_path(&self, folder: &Path) -> PathBuf {
        folder.join(&self.truth)
    }

    /// Whether virtual time is the computer's.
    pub fn runs_in_real_time(&self) -> bool {
        matches!(self.pace, Pace::Times(times) if times.get() == 1.0)
    }

    /// Makes virtual time pass like wall time if it would stand still, for interactive use and for programs that wait.
    pub fn keep_wall_clock(&mut self) {
        if self.pace == Pace::Lockstep {
            self.pace = Pace::Times(Positive::new(1.0).expect("one is above zero"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::toml_text;

    fn config(text: &str) -> Result<VirtualConfig, fieldgap_input::Fault> {
        toml_text(Path::new("rig.toml"), text)
    }

    #[test]
    fn what_is_not_written_has_its_default() {
        let text = "seed = 1\npace = \"lockstep\"\ntruth = \"truth/lab.toml\"\n[robot]\nsteps_per_mm = 100.0\n";
        let config = config(text).expect("valid");
        assert_eq!(config.pace, Pace::Lockstep);
        let RobotSettings::Marlin(robot) = config.robot else { panic!("Marlin is the default") };
        assert_eq!(robot.steps_per_mm.get(), 100.0);
        assert_eq!(robot.planner_moves, 15);
        assert_eq!(config.truth_path(Path::new("rigs")), Path::new("rigs/truth/lab.toml"));
    }

    #[test]
    fn a_pace_is_lockstep_or_a_factor_above_zero() {
        let with = |pace: &str| config(&format!("seed = 1\npace = {pace}\ntruth = \"t\"\n"));
        assert!(
            matches!(with("{ times = 20.0 }").expect("valid").pace, Pace::Times(f) if f.get() == 20.0)
        );
        for wrong in ["{ times = 0.0 }", "\"fast\"", "{ tims = 2.0 }"] {
            let fault = with(wrong).expect_err("wrong");
            assert_eq!(fault.line_column().map(|(line, _)| line), Some(2), "{fault}");
        }
    }
}
