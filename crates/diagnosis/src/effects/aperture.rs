//! The receiver averages the pressure over its face, a disc parallel to the array.
//!
//! A plane wave from an angle θ is heard as 2 J₁(x)/x with x = k a sin θ, as a radiating piston is (reciprocity). It is fitted
//! as the squared radius, in which it is linear when small.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Aperture;

impl Effect for Aperture {
    fn id(&self) -> EffectId {
        EffectId::Aperture
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.5, least: 0.0, most: 150.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::ReceiverDirectivity, EffectId::Directivity],
            independent_check: Some("callipers measure the opening of the receiver"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators give the pressure at a point; use a smaller or an omnidirectional receiver",
        )
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![16.0]]
    }

    fn sensitivity<'a>(
        &self,
        at: Setting<'a>,
        wavenumber_rad_m: f64,
    ) -> Option<Box<dyn Fn(f64) -> f64 + 'a>> {
        let radius_m = radius_m(at.values);
        (radius_m > 0.0).then(|| {
            Box::new(move |angle_rad| mean_over_face(radius_m, wavenumber_rad_m, angle_rad)) as _
        })
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let radius = fitted[0].value.max(1e-6).sqrt();
        let radius = fitted[0].map(radius, 0.5 / radius);
        let sentence = format!(
            "the receiver averages over a face of {:.2} ± {:.2} mm radius",
            radius.value, radius.error
        );
        Finding::new([("radius_mm", radius.real())], sentence)
    }
}

/// Radius of the receiver's face, m, at fitted values.
fn radius_m(values: &[f64]) -> f64 {
    1e-3 * values[0].max(0.0).sqrt()
}

/// The mean of a plane wave over a disc, relative to its middle: 2 J₁(x)/x with x = k a sin θ.
pub(crate) fn mean_over_face(radius_m: f64, wavenumber_rad_m: f64, angle_rad: f64) -> f64 {
    let x = wavenumber_rad_m * radius_m * angle_rad.sin();
    if x.abs() < 1e-4 { 1.0 - x * x / 8.0 } else { 2.0 * libm::j1(x) / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::effects::receiver_directivity::lobe;

    /// The first zero of J₁ lies at 3.8317 (Abramowitz and Stegun, table 9.5).
    #[test]
    fn a_face_hears_nothing_from_where_the_bessel_function_has_its_zero() {
        let (radius_m, wavenumber_rad_m) = (6e-3, 732.0);
        let angle_rad = (3.831_706f64 / (radius_m * wavenumber_rad_m)).asin();
        assert!(mean_over_face(radius_m, wavenumber_rad_m, angle_rad).abs() < 1e-6);
        let [below, above] =
            [1e-4 - 1e-9, 1e-4 + 1e-9].map(|x: f64| mean_over_face(1.0, 1.0, x.asin()));
        assert!((below - above).abs() < 1e-12);
    }

    /// exp(-c θ²) and 2 J₁(x)/x with x² = 8 c sin² θ differ by (c/3 - c²/6) θ⁴ and less: at c = 2, half at 33.7 degrees, the two agree
    /// to that order, however large the gap. Elsewhere they do not.
    #[test]
    fn a_face_of_5_45_mm_hears_as_a_lobe_of_34_degrees_does_and_no_other_pair_does_so_well() {
        let wavenumber_rad_m = std::f64::consts::TAU * 40e3 / 343.0;
        let farthest = |half_deg: f64, face_radius_m: f64| {
            (0..=35)
                .map(|degrees| {
                    let angle_rad = f64::from(degrees).to_radians();
                    let of_face = mean_over_face(face_radius_m, wavenumber_rad_m, angle_rad);
                    (lobe(half_deg.to_radians(), angle_rad) - of_face).abs()
                })
                .fold(0.0, f64::max)
        };
        let nearest = |half_deg: f64| {
            let faces_m = (100..800).map(|step| f64::from(step) * 1e-5);
            faces_m.map(|face_m| farthest(half_deg, face_m)).fold(f64::INFINITY, f64::min)
        };
        assert!(farthest(33.7, 5.45e-3) < 1e-3, "{}", farthest(33.7, 5.45e-3));
        for half_deg in [25.0, 45.0, 60.0] {
            assert!(nearest(half_deg) > 3e-3, "{half_deg}: {}", nearest(half_deg));
        }
    }
}
