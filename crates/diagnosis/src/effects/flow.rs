//! A steady wind across the field: a path of direction n takes d / (c + v·n) (Pierce, *Acoustics*, section 8-1).

use fieldgap_acoustics::{Propagation, Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// Up to this speed any is as likely as another: a fan beside the bench. (Rooms are comfortable below 0.3 m/s: ISO 7730.)
const FAN_M_S: f64 = 3.0;

/// Beyond it the logarithm of the speed is normal with this standard deviation: 8 m/s, a fresh breeze, is two of them off. Set by judgement.
const FASTER_WITHIN: f64 = 0.5;

/// The effect.
pub(crate) struct Flow;

impl Effect for Flow {
    fn id(&self) -> EffectId {
        EffectId::Flow
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.1, least: -30.0, most: 30.0 },
            Parameter { neutral: 0.0, scale: 0.1, least: -30.0, most: 30.0 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some("smoke or a thread shows air flow"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model still air of one temperature only; keep draughts and heat sources away",
        )
    }

    fn against_size(&self, values: &[f64]) -> f64 {
        let beyond = (values[0].hypot(values[1]) / FAN_M_S).max(1.0);
        0.5 * (beyond.ln() / FASTER_WITHIN).powi(2)
    }

    fn air(&self, at: Setting<'_>, speed_m_s: f64, air: &mut Propagation) {
        air.mach += Vec3::new(at.values[0], at.values[1], 0.0) / speed_m_s;
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y] = [fitted[0], fitted[1]];
        let sentence = format!(
            "air flows across the field at {:.2} m/s: {:.2} ± {:.2} along x, {:.2} ± {:.2} along y",
            x.value.hypot(y.value),
            x.value,
            x.error,
            y.value,
            y.error
        );
        Finding::new([("vx_m_s", x.real()), ("vy_m_s", y.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn a_wind_is_a_mach_number_of_the_true_speed_of_sound() {
        let bench = Bench::new();
        let mut air = Propagation::default();
        Flow.air(bench.at(&[3.4, -1.7]), 340.0, &mut air);
        assert!((air.mach - Vec3::new(0.01, -0.005, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_breeze_is_less_likely_than_a_fan_whichever_way_it_blows() {
        assert_eq!(Flow.against_size(&[0.0, 0.0]), 0.0);
        assert_eq!(Flow.against_size(&[1.8, -2.4]), 0.0);
        let breeze = Flow.against_size(&[FAN_M_S * std::f64::consts::E, 0.0]);
        assert!((breeze - 2.0).abs() < 1e-12, "{breeze}");
        assert_eq!(Flow.against_size(&[-4.8, 3.6]), Flow.against_size(&[0.0, 6.0]));
    }
}
