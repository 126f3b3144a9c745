//! Play between motor and tool head along x: the nozzle trails by half of it, to either side of where it is believed.
//!
//! It may also lead by half of it: where a firmware compensates for play that is not there, or where the reported place is that of a part
//! behind the play. The play itself is not negative; the fit works on a number that is positive where the nozzle trails.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Visit;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Backlash;

impl Effect for Backlash {
    fn id(&self) -> EffectId {
        EffectId::Backlash
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: -4.0, most: 4.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Direction,
            per_element: PerElement::No,
            mimics: &[EffectId::Lag],
            independent_check: Some("a dial gauge, approached from either side, measures the play"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("remove the play from the robot, or scan with order = \"raster\"")
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.3], vec![-0.3]]
    }

    fn position(&self, at: Setting<'_>, visit: &Visit, at_m: Vec3) -> Vec3 {
        let play_m = 1e-3 * at.values[0];
        // After a turn the nozzle stands still until the play is taken up.
        let taken_up_m = visit.motion.x_since_m.min(play_m.abs());
        let trails_m = (taken_up_m - 0.5 * play_m.abs()) * play_m.signum();
        at_m - Vec3::x() * (visit.motion.x_direction * trails_m)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let play = fitted[0].map(fitted[0].value.abs(), 1.0);
        let how = match fitted[0].value < 0.0 {
            true => {
                ", which the nozzle leads by half of, as where more play is compensated than there is"
            }
            false => "",
        };
        let sentence =
            format!("the robot has {:.2} ± {:.2} mm of play along x{how}", play.value, play.error);
        Finding::new([("mm", play.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};
    use crate::model::motion::Motion;

    #[test]
    fn the_two_directions_of_travel_differ_by_the_play() {
        let bench = Bench::new();
        let x_mm = |x_direction: f64| {
            let motion = Motion::steady(Vec3::zeros(), x_direction);
            let visit = Visit { motion, ..visit() };
            1e3 * Backlash.position(bench.at(&[0.4]), &visit, Vec3::zeros()).x
        };
        assert!((x_mm(-1.0) - x_mm(1.0) - 0.4).abs() < 1e-12);
        assert_eq!(x_mm(0.0), 0.0);
    }

    #[test]
    fn a_nozzle_that_turned_stands_still_until_the_play_is_taken_up() {
        let bench = Bench::new();
        let nozzle_mm = |play_mm: f64, x_since_m: f64| {
            let motion = Motion::steady(Vec3::zeros(), -1.0).since_turn(x_since_m);
            let reported = Vec3::x() * -x_since_m;
            1e3 * Backlash.position(bench.at(&[play_mm]), &Visit { motion, ..visit() }, reported).x
        };
        // It came from below, trailing by 0.2 mm, and turned at zero.
        for since_mm in [0.0, 0.1, 0.3] {
            assert!((nozzle_mm(0.4, 1e-3 * since_mm) + 0.2).abs() < 1e-12);
        }
        assert!((nozzle_mm(0.4, 1e-3) + 0.8).abs() < 1e-12);
        assert!((nozzle_mm(-0.4, 1e-3) + 1.2).abs() < 1e-12);
    }

    #[test]
    fn a_play_is_told_as_a_size_whether_the_nozzle_trails_or_leads() {
        let bench = Bench::new();
        for (value, leads) in [(0.4, false), (-0.4, true)] {
            let fitted = [Estimate { value, error: 0.01 }];
            let told = Backlash.describe(&fitted, &Choice::None, &bench.context);
            let play = Estimate { value: 0.4, error: 0.01 }.real();
            assert_eq!(told.parameters["mm"], play);
            assert_eq!(told.sentence.contains("leads"), leads, "{}", told.sentence);
        }
    }
}
