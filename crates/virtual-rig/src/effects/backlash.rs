//! Play between motor and tool head along x: the nozzle trails by half of it.
//!
//! After a reversal the nozzle stands still until the play is taken up. Before the first travel along x it is in the middle.
//! (A second reversal within the play is treated as a full one.)

use serde::Deserialize;

use super::Effect;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Backlash {
    /// The play, mm.
    mm: NonNegative,
}

impl Effect for Backlash {
    fn place(&self, at_m: &mut Vec3, kinematics: &Kinematics) {
        let play_mm = self.mm.get();
        let left_mm = (play_mm - kinematics.x_since_reversal_mm).max(0.0);
        at_m.x += kinematics.x_direction * (left_mm - 0.5 * play_mm) * 1e-3;
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_two_directions_differ_by_the_play() {
        let backlash = effect::<Backlash>("mm = 0.4");
        let x_mm = |x_direction: f64, x_since_reversal_mm: f64| {
            let mut at = Vec3::zeros();
            let kinematics =
                Kinematics { x_direction, x_since_reversal_mm, ..Kinematics::resting() };
            backlash.place(&mut at, &kinematics);
            at.x * 1e3
        };
        assert!((x_mm(-1.0, 10.0) - x_mm(1.0, 10.0) - 0.4).abs() < 1e-12);
        assert_eq!(x_mm(0.0, 0.0), 0.0);
        // At the moment of reversal the nozzle is where the other direction left it.
        assert!((x_mm(1.0, 0.0) - x_mm(-1.0, 10.0)).abs() < 1e-12);
    }
}
