//! The search on a rig.

use super::cross::{AxisError, Cross, Stride};
use super::line::BeamAxis;
use crate::{RigSetup, element_delays};
use fieldgap_acoustics::{Array, Excitation, Vec3};
use fieldgap_rig::ManualRig;

/// Readings along an arm, less one: even, so that the middle is one of them.
const STEPS: usize = 14;

/// Step of the first look, as a share of a fine arm's half length.
const LOOK_STEP: f64 = 0.4;

/// Half length of an arm, as a share of the way from the top of the lobe to its first null.
const TO_NULL: f64 = 0.5;

/// Shortest half length of an arm, m.
const SHORTEST_M: f64 = 3e-3;

/// What to search.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisSearch {
    /// Heights of the crosses above the array's face, m; above zero, at least one.
    pub heights_m: Vec<f64>,
    /// How far to either side the beam is looked for at the first height, m.
    pub reach_m: f64,
}

/// Finds the beam's axis: at each height the array focuses on its own axis, and crosses are made through the beam until
/// one is centred on it.
///
/// The robot has been homed. `found` is told of each cross. The array is silent afterwards, however it ends.
///
/// # Errors
/// [`AxisError`]: a device that fails, a cross out of the robot's reach, a beam that is not there or does not keep still.
pub async fn find_axis(
    rig: &mut ManualRig,
    rig_setup: &RigSetup,
    search: &AxisSearch,
    mut found: impl FnMut(&Cross),
) -> Result<BeamAxis, AxisError> {
    within_reach(rig_setup, search)?;
    let stride = Stride {
        frame: rig_setup.rig.motion.frame(),
        feed: rig_setup.rig.motion.feed(),
        settle: rig_setup.rig.receiver.settle(),
        readings: rig_setup.rig.receiver.count(),
    };
    rig.array().continuous_wave().await?;
    let mut crosses: Vec<Cross> = Vec::with_capacity(search.heights_m.len());
    for &z_m in &search.heights_m {
        let half_m = half_arm_m(rig_setup, z_m);
        let focus = Excitation::Focus(Vec3::new(0.0, 0.0, z_m));
        rig.array().set_delays(&element_delays(rig_setup, &focus)).await?;
        rig.array().emit().await?;
        let middle_m = match crosses.last() {
            Some(cross) => Vec3::new(cross.x_m.value, cross.y_m.value, z_m),
            None => {
                let steps = 2 * (search.reach_m / (LOOK_STEP * half_m)).ceil().max(1.0) as usize;
                stride.look(rig, Vec3::new(0.0, 0.0, z_m), search.reach_m, steps).await?
            }
        };
        let cross = stride.cross(rig, middle_m, half_m, STEPS).await?;
        found(&cross);
        crosses.push(cross);
    }
    rig.array().silence().await?;
    Ok(BeamAxis::through(crosses))
}

/// Half length of an arm at a height, m: half way to the first null of an aperture as wide as the array.
fn half_arm_m(rig_setup: &RigSetup, z_m: f64) -> f64 {
    let wavelength_m =
        rig_setup.nominal_medium().speed_of_sound_m_s / rig_setup.array.frequency_hz();
    (TO_NULL * wavelength_m * z_m / aperture_m(rig_setup.nominal_array())).max(SHORTEST_M)
}

/// The wider side of the array, from centre to centre of its outermost elements and half a wavelength at the least, m.
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

/// Makes sure that every arm can be gone along before anything moves.
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
