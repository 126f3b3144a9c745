//! The lead screw of one axis is bent or badly cut: the position along it errs periodically, once a turn.
//!
//! The true position is s + a sin(2π s/L + φ) where the robot reports s (A. H. Slocum, *Precision Machine Design*, section 10.8). The fit works on
//! a cos φ, a sin φ and 1/L: the cost is smooth in the first two, and has a minimum for each turn over the field in the third.

use std::f64::consts::TAU;

use fieldgap_acoustics::{Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Visit;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct LeadScrew;

/// The axes in the order of the choices.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Part of the error in phase with the origin, or in quadrature, mm.
const PART: Parameter = Parameter { neutral: 0.0, scale: 0.01, least: -3.0, most: 3.0 };

impl LeadScrew {
    /// An error along an axis, m, of sine and cosine over the reported position, so many turns a metre, as what a fit works on.
    pub fn along(
        axis: usize,
        [sine_m, cosine_m]: [f64; 2],
        turns_per_m: f64,
    ) -> (Choice, Vec<f64>) {
        (Choice::Law(axis as u8), vec![1e3 * sine_m, 1e3 * cosine_m, 1e-3 * turns_per_m])
    }
}

impl Effect for LeadScrew {
    fn id(&self) -> EffectId {
        EffectId::LeadScrew
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[PART, PART, Parameter { neutral: 0.1, scale: 1e-4, least: 0.02, most: 2.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some(
                "a dial gauge along the axis, read every half millimetre, shows the error",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "no set-up file describes the errors of an axis; straighten or replace the screw",
        )
    }

    fn search(&self) -> Search {
        Search::Periods
    }

    fn choices(&self) -> Vec<Choice> {
        (0..3).map(Choice::Law).collect()
    }

    fn position(&self, at: Setting<'_>, visit: &Visit, at_m: Vec3) -> Vec3 {
        let Choice::Law(axis) = *at.choice else { return at_m };
        let axis = usize::from(axis);
        let (sin, cos) = (TAU * at.values[2] * 1e3 * visit.at_m[axis]).sin_cos();
        let mut truly_m = at_m;
        truly_m[axis] += 1e-3 * (at.values[0] * sin + at.values[1] * cos);
        truly_m
    }

    fn describe(&self, fitted: &[Estimate], choice: &Choice, _believed: &Context) -> Finding {
        let [sine, cosine, turns] = [fitted[0], fitted[1], fitted[2]];
        let axis = match choice {
            Choice::Law(axis) => AXES[usize::from(*axis)],
            _ => AXES[0],
        };
        let size = sine.value.hypot(cosine.value);
        let [along, across] = [sine, cosine].map(|part| part.value / size.max(f64::MIN_POSITIVE));
        let amplitude =
            Estimate { value: size, error: (along * sine.error).hypot(across * cosine.error) };
        let phase = Estimate {
            value: cosine.value.atan2(sine.value),
            error: (across * sine.error).hypot(along * cosine.error) / size.max(f64::MIN_POSITIVE),
        };
        let lead = turns.map(turns.value.recip(), turns.value.powi(-2));
        let sentence = format!(
            "the position along {axis} errs by up to {:.3} ± {:.3} mm, once in {:.2} ± {:.2} mm",
            amplitude.value, amplitude.error, lead.value, lead.error
        );
        Finding::new(
            [
                ("axis", FittedParameter::Word { value: axis }),
                ("amplitude_mm", amplitude.real()),
                ("lead_mm", lead.real()),
                ("phase_rad", phase.real()),
            ],
            sentence,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};

    #[test]
    fn the_error_has_its_phase_where_the_robot_reports_zero() {
        let bench = Bench::new();
        let (amplitude_mm, phase_rad, lead_mm) = (0.2, 0.7f64, 8.0);
        let (choice, values) = LeadScrew::along(
            1,
            [1e-3 * amplitude_mm * phase_rad.cos(), 1e-3 * amplitude_mm * phase_rad.sin()],
            1e3 / lead_mm,
        );
        let setting = Setting { choice: &choice, ..bench.at(&values) };
        for reported_mm in [0.0, 1.3, 9.3] {
            let at_m = Vec3::new(0.01, 1e-3 * reported_mm, 0.1);
            let truly_m = LeadScrew.position(setting, &Visit { at_m, ..visit() }, at_m);
            let error_mm = amplitude_mm * (TAU * reported_mm / lead_mm + phase_rad).sin();
            assert!((1e3 * (truly_m - at_m) - Vec3::y() * error_mm).norm() < 1e-12);
        }
        let told = values.iter().map(|&value| Estimate { value, error: 0.001 });
        let told: Vec<Estimate> = told.collect();
        let found = LeadScrew.describe(&told, &choice, &bench.context);
        assert_eq!(found.parameters["axis"], FittedParameter::Word { value: "y" });
        let real = |name| match found.parameters[name] {
            FittedParameter::Real { value, .. } => value,
            _ => f64::NAN,
        };
        assert!((real("phase_rad") - phase_rad).abs() < 1e-12);
        assert!((real("lead_mm") - lead_mm).abs() < 1e-9);
    }
}
