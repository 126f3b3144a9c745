//! One cross: an arm along x and an arm along y through the beam, repeated until the cross is centred.

use serde::Serialize;

use super::line::Estimate;
use super::lobe::{Lobe, LobeFault, fit_lobe};
use fieldgap_acoustics::Vec3;
use fieldgap_rig::{Feed, Frame, ManualRig, RigError};

/// Most crosses at one height; two are nearly always enough.
const MOST_CROSSES: usize = 6;

/// A cross is centred if its arms miss the peak by less than this share of their half length.
const CENTRED: f64 = 0.1;

/// The centre of the beam at one height, in the array frame of the rig file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cross {
    /// Height, m.
    pub z_m: f64,
    /// Centre along x, m.
    pub x_m: Estimate,
    /// Centre along y, m.
    pub y_m: Estimate,
    /// Level at the centre, in the receiver's unit.
    pub level: f64,
    /// Whether some readings were clipped; these were not used.
    pub clipped: bool,
}

/// Why the beam axis was not found.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum AxisError {
    /// A device failed.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Rig(#[from] RigError),
    /// The cross does not fit into the robot's travel.
    #[error("the cross at z = {z_mm:.1} mm does not fit into the robot's travel: {fault}")]
    #[diagnostic(help(
        "choose other heights with --heights-mm, or a smaller search range with --reach-mm"
    ))]
    OutOfReach {
        /// Its height, mm.
        z_mm: f64,
        /// Why the path is not possible.
        fault: fieldgap_rig::PathFault,
    },
    /// No beam.
    #[error("no beam was found at z = {z_mm:.1} mm, along {arm}: {fault}")]
    #[diagnostic(help(
        "check that the array emits and the receiver responds (`fieldgap rig sample RIG --focus-mm 0,0,{z_mm:.0}`); or search \
         a wider range with --reach-mm"
    ))]
    NoBeam {
        /// The height, mm.
        z_mm: f64,
        /// Which arm.
        arm: char,
        /// Why no lobe could be fitted.
        fault: LobeFault,
    },
    /// The centre differs from cross to cross.
    #[error(
        "at z = {z_mm:.1} mm the centre of the beam differed in each of {MOST_CROSSES} crosses"
    )]
    #[diagnostic(help(
        "check for a loose receiver, moving air or a beam with several peaks; or try another height"
    ))]
    Unsteady {
        /// The height, mm.
        z_mm: f64,
    },
}

/// One reading on an arm.
#[derive(Debug, Clone, Copy)]
struct ArmReading {
    /// Reported position along the arm, m.
    at_m: f64,
    level: f64,
    clipped: bool,
}

/// Direction of an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Arm {
    X,
    Y,
}

/// Measures arms and crosses.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArmScan {
    pub(super) frame: Frame,
    pub(super) feed: Feed,
    pub(super) settle: std::time::Duration,
    pub(super) readings: usize,
}

impl ArmScan {
    /// Coarse search along wide arms: along x, along y, and again along x, because the first arm may have passed far from
    /// the beam.
    pub(super) async fn coarse_search(
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

    /// Scans crosses until one is centred on the beam.
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
                // The flanks of a clipped lobe still give its centre.
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
                // A peak beyond the end of the arm gives only the direction.
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

    /// Readings along an arm through a centre.
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
