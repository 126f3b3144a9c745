//! The search on a rig.

use super::cross::{ArmScan, AxisError, Cross};
use super::line::BeamAxis;
use crate::{RigSetup, element_delays};
use fieldgap_acoustics::{Array, Excitation, Vec3};
use fieldgap_rig::ManualRig;

/// Steps along an arm: even, so that one reading is at the centre.
const STEPS: usize = 14;

/// Step of the coarse search, as a share of half a fine arm.
const COARSE_STEP: f64 = 0.4;

/// Half length of an arm, as a share of the distance from the peak to the first null.
const TO_NULL: f64 = 0.5;

/// Shortest half length of an arm, m.
const SHORTEST_M: f64 = 3e-3;

/// What to search.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSearch {
    /// Heights of the crosses above the array face, m; at least one, all above zero.
    pub heights_m: Vec<f64>,
    /// Half width of the coarse search at the first height, m.
    pub reach_m: f64,
}

impl AxisSearch {
    /// The drives of the array, in the order of the heights: a focus on its own axis at each.
    pub fn drives(&self) -> Vec<Excitation> {
        self.heights_m.iter().map(|&z_m| Excitation::Focus(Vec3::new(0.0, 0.0, z_m))).collect()
    }
}

/// Finds the beam axis: at each height the array focuses on its own axis, and crosses are scanned until one is centred on
/// the beam.
///
/// The robot must be homed. `found` is called with each cross. The array is silent at the end of a successful search; after
/// an error the caller makes the rig safe.
///
/// # Errors
/// [`AxisError`]: a device failed, a cross is out of reach, or the beam was not found or is unsteady.
pub async fn find_axis(
    rig: &mut ManualRig,
    rig_setup: &RigSetup,
    search: &AxisSearch,
    mut found: impl FnMut(&Cross),
) -> Result<BeamAxis, AxisError> {
    within_reach(rig_setup, search)?;
    let arm_scan = ArmScan {
        frame: rig_setup.rig.motion.frame(),
        feed: rig_setup.rig.motion.feed(),
        settle: rig_setup.rig.receiver.settle(),
        readings: rig_setup.rig.receiver.count(),
    };
    rig.array().continuous_wave().await?;
    let mut crosses: Vec<Cross> = Vec::with_capacity(search.heights_m.len());
    for (&z_m, focus) in search.heights_m.iter().zip(search.drives()) {
        let half_m = half_arm_m(rig_setup, z_m);
        rig.array().set_delays(&element_delays(rig_setup, &focus)).await?;
        rig.array().emit().await?;
        let middle_m = match crosses.last() {
            Some(cross) => Vec3::new(cross.x_m.value, cross.y_m.value, z_m),
            None => {
                let steps = 2 * (search.reach_m / (COARSE_STEP * half_m)).ceil().max(1.0) as usize;
                arm_scan.coarse_search(rig, Vec3::new(0.0, 0.0, z_m), search.reach_m, steps).await?
            }
        };
        let cross = arm_scan.cross(rig, middle_m, half_m, STEPS).await?;
        found(&cross);
        crosses.push(cross);
    }
    rig.array().silence().await?;
    Ok(BeamAxis::through(crosses))
}

/// Half length of an arm at a height, m: half the distance to the first null of an aperture as wide as the array.
fn half_arm_m(rig_setup: &RigSetup, z_m: f64) -> f64 {
    let wavelength_m =
        rig_setup.nominal_medium().speed_of_sound_m_s / rig_setup.array.frequency_hz();
    (TO_NULL * wavelength_m * z_m / aperture_m(rig_setup.nominal_array())).max(SHORTEST_M)
}

/// The longer side of the array, between the centres of its outermost elements, and at least 5 mm, m.
fn aperture_m(array: &Array) -> f64 {
    let side = |axis: usize| {
        let along = array.elements().iter().map(|element| element.centre_m[axis]);
        let (least, largest) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |range, at| {
            (range.0.min(at), range.1.max(at))
        });
        largest - least
    };
    side(0).max(side(1)).max(5e-3)
}

/// Checks that the robot can move along every arm, before anything moves.
fn within_reach(rig_setup: &RigSetup, search: &AxisSearch) -> Result<(), AxisError> {
    let (envelope, frame) = (rig_setup.rig.motion.envelope(), rig_setup.rig.motion.frame());
    for (number, &z_m) in search.heights_m.iter().enumerate() {
        let half_m = half_arm_m(rig_setup, z_m);
        let reach_m = if number == 0 { search.reach_m.max(half_m) } else { half_m };
        for arm in [Vec3::x(), Vec3::y()] {
            let end = |side: f64| frame.to_robot(arm * reach_m * side + Vec3::new(0.0, 0.0, z_m));
            let (from, to) = (end(-1.0), end(1.0));
            envelope
                .check_target(from)
                .and_then(|()| envelope.check_path(from, to))
                .map_err(|fault| AxisError::OutOfReach { z_mm: z_m * 1e3, fault })?;
        }
    }
    Ok(())
}
