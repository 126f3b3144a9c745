//! The receiver's sensitivity falls with the angle of arrival, counted from its axis (it looks at the array): a Gaussian
//! in the angle, -6 dB at the given one.
//!
//! It is fitted as the inverse square of that angle, which is zero for an even receiver.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::limits::MOST_HALF_ANGLE_DEG;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct ReceiverDirectivity;

impl Effect for ReceiverDirectivity {
    fn id(&self) -> EffectId {
        EffectId::ReceiverDirectivity
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: 0.0, most: 60.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::Aperture, EffectId::Directivity],
            independent_check: Some("rotating the receiver in place shows its lobe"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators give the pressure at a point; use a smaller or an omnidirectional receiver",
        )
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![0.1], vec![2.0]]
    }

    fn sensitivity<'a>(
        &self,
        at: Setting<'a>,
        _wavenumber_rad_m: f64,
    ) -> Option<Box<dyn Fn(f64) -> f64 + 'a>> {
        let half_rad = half_angle_rad(at.values);
        half_rad.is_finite().then(|| Box::new(move |angle_rad| lobe(half_rad, angle_rad)) as _)
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let half_rad = 1.0 / fitted[0].value.max(1e-6).sqrt();
        let half_deg =
            fitted[0].map(half_rad.to_degrees(), 0.5 * half_rad.to_degrees() * half_rad * half_rad);
        let is_determined = half_deg.value < MOST_HALF_ANGLE_DEG;
        let bound = Estimate { value: MOST_HALF_ANGLE_DEG, error: f64::NAN };
        let half_deg = if is_determined { half_deg } else { bound };
        let sentence = match is_determined {
            true => format!(
                "the receiver's sensitivity is halved (-6 dB) at {:.1} ± {:.1} degrees from its axis",
                half_deg.value, half_deg.error
            ),
            false => "the receiver's sensitivity falls too little with the angle to determine its \
                      half-angle"
                .to_owned(),
        };
        Finding::new([("half_angle_deg", half_deg.real())], sentence)
    }
}

/// Angle at which the receiver hears half, rad, at fitted values; infinite for an even receiver.
fn half_angle_rad(values: &[f64]) -> f64 {
    1.0 / values[0].max(0.0).sqrt()
}

/// A Gaussian in the angle that is a half at `half_rad`, the usual fit of data-sheet lobes.
pub(crate) fn lobe(half_rad: f64, angle_rad: f64) -> f64 {
    (-std::f64::consts::LN_2 * (angle_rad / half_rad).powi(2)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use crate::fitted_parameter::FittedParameter;

    #[test]
    fn the_sensitivity_is_a_half_at_the_half_angle() {
        let bench = Bench::new();
        let half_rad = 0.6f64;
        let values = [1.0 / (half_rad * half_rad)];
        let sensitivity =
            ReceiverDirectivity.sensitivity(bench.at(&values), 732.0).expect("a lobe");
        assert!(
            (sensitivity(half_rad) - 0.5).abs() < 1e-12 && (sensitivity(0.0) - 1.0).abs() < 1e-12
        );
        assert!(ReceiverDirectivity.sensitivity(bench.at(&[0.0]), 732.0).is_none());
    }

    #[test]
    fn no_half_angle_is_told_from_behind_the_receiver() {
        let bench = Bench::new();
        for value in [0.0, 1e-3, 0.3] {
            let fitted = [Estimate { value, error: 0.01 }];
            let told = ReceiverDirectivity.describe(&fitted, &Choice::None, &bench.context);
            assert!(told.sentence.contains("too little"), "{}", told.sentence);
            let FittedParameter::Real { value, standard_error } = told.parameters["half_angle_deg"]
            else {
                panic!("a number")
            };
            assert!(value == MOST_HALF_ANGLE_DEG && standard_error.is_nan());
        }
    }
}
