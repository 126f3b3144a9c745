//! The lead screw of x has a periodic error: the position deviates sinusoidally, one period per turn.

use std::f64::consts::TAU;

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Finite, Positive};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LeadScrew {
    /// Travel per turn.
    lead_mm: Positive,
    amplitude_mm: Finite,
    /// Phase of the error at the array's centre.
    phase_rad: Finite,
}

impl Effect for LeadScrew {
    fn place(&self, at_m: &mut Vec3, kinematics: &Kinematics) {
        let turns = kinematics.position_mm.x / self.lead_mm.get();
        let error_mm = self.amplitude_mm.get() * (TAU * turns + self.phase_rad.get()).sin();
        at_m.x += error_mm * 1e-3;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_error_is_periodic_in_the_lead() {
        let screw: LeadScrew = effect("lead_mm = 8.0\namplitude_mm = 0.5\nphase_rad = 0.3");
        let error_mm = |x_mm: f64| {
            let mut at_m = Vec3::zeros();
            let position_mm = Vec3::new(x_mm, 0.0, 0.0);
            screw.place(&mut at_m, &Kinematics { position_mm, ..Kinematics::resting() });
            at_m.x * 1e3
        };
        assert!((error_mm(3.0) - error_mm(11.0)).abs() < 1e-12);
        assert!((error_mm(3.0) + error_mm(7.0)).abs() < 1e-12);
        assert!((error_mm(0.0) - 0.5 * 0.3f64.sin()).abs() < 1e-12);
    }
}
