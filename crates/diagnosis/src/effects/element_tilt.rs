//! The axes of the elements point elsewhere than believed: each is turned by a normal number about x, then by another about y.
//!
//! Elements that are pressed into holes or soldered by hand lean. A lobe that points elsewhere changes the amplitude of an element by another factor in
//! each direction, so that in one plane leaning elements look like unequal ones.

use fieldgap_acoustics::{Element, Simulator, Vec3};
use nalgebra::Rotation3;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect. Its numbers are the angles of all elements about x, then those about y, rad.
pub(crate) struct ElementTilt;

/// Lean from which on it is seen by eye, rad, and how much more is likely all the same. Without it two angles of each of 64 elements, of 43 degrees, imitated
/// steps of phase. Set by judgement.
const SEEN_RAD: f64 = 0.2;
const BEYOND_RAD: f64 = 0.02;

impl Effect for ElementTilt {
    fn id(&self) -> EffectId {
        EffectId::ElementTilt
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::Axis,
            mimics: &[EffectId::ElementGain],
            independent_check: Some(
                "a straight edge laid on the elements shows which of them lean",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "no set-up file states the axis of each element: seat the elements that lean furthest",
        )
    }

    fn search(&self) -> Search {
        Search::Random
    }

    fn against_size(&self, values: &[f64]) -> f64 {
        let square = values.iter().map(|angle| angle * angle).sum::<f64>();
        let rms_rad = (square / values.len().max(1) as f64).sqrt();
        0.5 * ((rms_rad - SEEN_RAD).max(0.0) / BEYOND_RAD).powi(2)
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        let (about_x, about_y) = at.values.split_at(at.values.len() / 2);
        for ((element, x), y) in elements.iter_mut().zip(about_x).zip(about_y) {
            let tilt = Rotation3::from_axis_angle(&Vec3::y_axis(), *y)
                * Rotation3::from_axis_angle(&Vec3::x_axis(), *x);
            element.normal = tilt * element.normal;
        }
    }

    /// The spread's estimate comes last, after the angles of the elements.
    fn describe(&self, fitted: &[Estimate], _: &Choice, _: &Context) -> Finding {
        let unknown = Estimate { value: f64::NAN, error: f64::NAN };
        let (spread, each) = fitted.split_last().unwrap_or((&unknown, &[]));
        let of_each = |angles: &[Estimate]| FittedParameter::Each {
            value: angles.iter().map(|angle| angle.value).collect(),
            standard_error: angles.iter().map(|angle| angle.error).collect(),
        };
        let (about_x, about_y) = each.split_at(each.len() / 2);
        let parameters = [
            ("spread_rad", spread.real()),
            ("about_x_rad", of_each(about_x)),
            ("about_y_rad", of_each(about_y)),
        ];
        let sentence = format!(
            "the elements lean by {:.1} ± {:.1} degrees about each axis, each by itself",
            spread.value.to_degrees(),
            spread.error.to_degrees()
        );
        Finding::new(parameters, sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn a_lean_that_is_seen_by_eye_is_less_likely() {
        assert_eq!(ElementTilt.against_size(&[]), 0.0);
        assert_eq!(ElementTilt.against_size(&[0.2, -0.2]), 0.0);
        assert!((ElementTilt.against_size(&[0.24, -0.24, 0.24, 0.24]) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn each_element_is_turned_about_its_own_centre() {
        let bench = Bench::new();
        let mut elements = [Element::at(0.0, 0.01), Element::at(0.02, 0.0)];
        let before = elements;
        ElementTilt.elements(bench.at(&[0.1, 0.0, 0.0, 0.2]), &mut elements);
        let (sin, cos) = 0.1f64.sin_cos();
        assert!((elements[0].normal - Vec3::new(0.0, -sin, cos)).norm() < 1e-12);
        let (sin, cos) = 0.2f64.sin_cos();
        assert!((elements[1].normal - Vec3::new(sin, 0.0, cos)).norm() < 1e-12);
        assert_eq!(elements.map(|element| element.centre_m), before.map(|e| e.centre_m));
    }
}
