//! The reading trails the motion: it is that of where the nozzle was a moment ago.
//!
//! Unlike play it grows with speed and acts along every axis.

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Visit;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Lag;

impl Effect for Lag {
    fn id(&self) -> EffectId {
        EffectId::Lag
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.001, least: 0.0, most: 1.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Velocity,
            per_element: PerElement::No,
            mimics: &[EffectId::Backlash],
            independent_check: Some("a burst of sound at rest shows the delay of the receiver"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "increase settle_ms of the receiver; for readings in motion, add the lag to lag_ms of [fly]",
        )
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![5e-3], vec![2.5e-2]]
    }

    fn position(&self, at: Setting<'_>, visit: &Visit, at_m: Vec3) -> Vec3 {
        at_m + visit.motion.back_m(at.values[0])
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "readings lag behind the motion by {:.1} ± {:.1} ms",
            1e3 * fitted[0].value,
            1e3 * fitted[0].error
        );
        Finding::new([("s", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};
    use crate::model::motion::Motion;

    #[test]
    fn a_reading_belongs_where_the_nozzle_was() {
        let bench = Bench::new();
        let motion = Motion::steady(Vec3::x() * 0.05, 1.0);
        let visit = Visit { motion, ..visit() };
        let at_m = Lag.position(bench.at(&[0.02]), &visit, Vec3::new(0.01, 0.0, 0.1));
        assert!((at_m - Vec3::new(0.009, 0.0, 0.1)).norm() < 1e-12);
    }
}
