//! One cross: an arm along x and an arm along y through the beam, measured until it is centred on it.

use serde::Serialize;

use super::line::Estimate;
use super::lobe::{Lobe, LobeFault, fit_lobe};
use fieldgap_acoustics::Vec3;
use fieldgap_rig::{Feed, Frame, ManualRig, RigError};

/// Crosses made at one height before the search is given up: the second is nearly always the last.
const MOST_CROSSES: usize = 6;

/// A cross is centred where its arms miss the lobe's top by less than this share of their half length.
const CENTRED: f64 = 0.1;

/// Where the beam's middle was found at one height, array frame as the rig file has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cross {
    /// Its height, m.
    pub z_m: f64,
    /// Its middle along x, m.
    pub x_m: Estimate,
    /// Its middle along y, m.
    pub y_m: Estimate,
    /// The level there, in the receiver's unit.
    pub level: f64,
    /// Whether the converter was at its limit in some of its readings, which were left out.
    pub clipped: bool,
}

/// Why the axis was not found.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum AxisError {
    /// A device failed.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Rig(#[from] RigError),
    /// The cross does not fit into the robot's travel.
    #[error("the cross at z = {z_mm:.1} mm does not fit into the robot's travel: {fault}")]
    #[diagnostic(help("give other heights with --heights-mm, or shorter arms with --reach-mm"))]
    OutOfReach {
        /// Its height, mm.
        z_mm: f64,
        /// What is in the way.
        fault: fieldgap_rig::PathFault,
    },
    /// No beam.
    #[error("no beam was found at z = {z_mm:.1} mm, along {arm}: {fault}")]
    #[diagnostic(help(
        "check that the array sounds and the receiver hears it (`fieldgap rig sample RIG --focus-mm 0,0,{z_mm:.0}`); look \
         farther with --reach-mm"
    ))]
    NoBeam {
        /// The height, mm.
        z_mm: f64,
        /// Which arm.
        arm: char,
        /// What was seen.
        fault: LobeFault,
    },
    /// The middle keeps moving.
    #[error(
        "at z = {z_mm:.1} mm the beam's middle was elsewhere in each of {MOST_CROSSES} crosses"
    )]
    #[diagnostic(help(
        "look for a loose receiver, moving air, or a beam with several tops; try another height"
    ))]
    Unsteady {
        /// The height, mm.
        z_mm: f64,
    },
}

/// One reading on an arm.
#[derive(Debug, Clone, Copy)]
struct ArmReading {
    /// Where the robot says it is along the arm, m.
    at_m: f64,
    level: f64,
    clipped: bool,
}

/// Which way an arm goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Arm {
    X,
    Y,
}

/// How arms are measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stride {
    pub(super) frame: Frame,
    pub(super) feed: Feed,
    pub(super) settle: std::time::Duration,
    pub(super) readings: usize,
}

impl Stride {
    /// Looks for the beam along wide arms: along x, along y, and along x once more, which the first arm may have crossed
    /// where there was little of it.
    pub(super) async fn look(
        &self,
        rig: &mut ManualRig,
        mut middle_m: Vec3,
        reach_m: f64,
        steps: usize,
    ) -> Result<Vec3, AxisError> {
        for arm in [Arm::X, Arm::Y, Arm::X] {
            let readings = self.measure(rig, middle_m, arm, reach_m, steps).await?;
            let strongest = readings
                .iter()
                .max_by(|a, b| a.level.total_cmp(&b.level))
                .expect("an arm has readings");
            middle_m[arm as usize] = strongest.at_m;
        }
        Ok(middle_m)
    }

    /// Makes crosses about a middle until one is centred on the beam.
    pub(super) async fn cross(
        &self,
        rig: &mut ManualRig,
        mut middle_m: Vec3,
        half_m: f64,
        steps: usize,
    ) -> Result<Cross, AxisError> {
        let z_mm = middle_m.z * 1e3;
        for _ in 0..MOST_CROSSES {
            let mut missed_m = 0.0_f64;
            let mut lobes = [None; 2];
            let mut clipped = false;
            for arm in [Arm::X, Arm::Y] {
                let readings = self.measure(rig, middle_m, arm, half_m, steps).await?;
                // A lobe whose top is cut off has its middle where its flanks say.
                let whole: Vec<(f64, f64)> = readings
                    .iter()
                    .filter(|reading| !reading.clipped)
                    .map(|reading| (reading.at_m, reading.level))
                    .collect();
                clipped |= whole.len() < readings.len();
                let lobe: Lobe = fit_lobe(&whole).map_err(|fault| AxisError::NoBeam {
                    z_mm,
                    arm: if arm == Arm::X { 'x' } else { 'y' },
                    fault,
                })?;
                // A top beyond the arm's end is only a direction to go.
                let step_m = (lobe.centre_m - middle_m[arm as usize]).clamp(-half_m, half_m);
                middle_m[arm as usize] += step_m;
                missed_m = missed_m.max(step_m.abs());
                lobes[arm as usize] = Some(lobe);
            }
            if let ([Some(x), Some(y)], true) = (lobes, missed_m < CENTRED * half_m) {
                let centre =
                    |lobe: Lobe| Estimate { value: lobe.centre_m, error: lobe.centre_error_m };
                return Ok(Cross {
                    z_m: middle_m.z,
                    x_m: centre(x),
                    y_m: centre(y),
                    level: y.level,
                    clipped,
                });
            }
        }
        Err(AxisError::Unsteady { z_mm })
    }

    /// Readings along an arm through a middle.
    async fn measure(
        &self,
        rig: &mut ManualRig,
        middle_m: Vec3,
        arm: Arm,
        half_m: f64,
        steps: usize,
    ) -> Result<Vec<ArmReading>, RigError> {
        let mut readings = Vec::with_capacity(steps + 1);
        for step in 0..=steps {
            let mut at_m = middle_m;
            at_m[arm as usize] += half_m * (2.0 * step as f64 / steps as f64 - 1.0);
            let reported = rig.robot().move_to(self.frame.to_robot(at_m), self.feed).await?;
            let reading = rig.receiver().read_point(self.settle, self.readings).await?;
            readings.push(ArmReading {
                at_m: self.frame.to_array(reported)[arm as usize],
                level: reading.mean,
                clipped: reading.clipped,
            });
        }
        Ok(readings)
    }
}
