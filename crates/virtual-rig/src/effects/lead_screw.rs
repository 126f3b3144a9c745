//! The lead screw of an axis has a periodic error: the position deviates sinusoidally, one period per turn.

use std::f64::consts::TAU;

use serde::Deserialize;

use super::{Axis, Effect};
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Finite, Positive};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LeadScrew {
    axis: Axis,
    amplitude_mm: Finite,
    /// Travel per turn.
    lead_mm: Positive,
    /// Phase of the error at the array's centre.
    phase_rad: Finite,
}

impl Effect for LeadScrew {
    /// First of all effects on the position, so that it acts at the coordinate that the robot reports.
    fn place(&self, at_m: &mut Vec3, _kinematics: &Kinematics) {
        let along = &mut at_m[self.axis as usize];
        let turns = *along * 1e3 / self.lead_mm.get();
        let error_mm = self.amplitude_mm.get() * (TAU * turns + self.phase_rad.get()).sin();
        *along += error_mm * 1e-3;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_error_is_periodic_in_the_lead_and_along_its_axis() {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let screw: LeadScrew = effect(&format!(
                "axis = \"{name}\"\nlead_mm = 8.0\namplitude_mm = 0.5\nphase_rad = 0.3"
            ));
            let error_mm = |at_mm: f64| {
                let mut at_m = Vec3::ith(axis, at_mm * 1e-3);
                screw.place(&mut at_m, &Kinematics::resting());
                let error_m = at_m - Vec3::ith(axis, at_mm * 1e-3);
                assert_eq!(error_m.norm(), error_m[axis].abs());
                error_m[axis] * 1e3
            };
            assert!((error_mm(3.0) - error_mm(11.0)).abs() < 1e-12);
            assert!((error_mm(3.0) + error_mm(7.0)).abs() < 1e-12);
            assert!((error_mm(0.0) - 0.5 * 0.3f64.sin()).abs() < 1e-12);
        }
    }
}
