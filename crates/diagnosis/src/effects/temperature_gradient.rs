//! The speed of sound varies linearly through the field: c(x) = c (1 + g·x).
//!
//! A kelvin changes it by 0.17 %. Straight rays; their bending lengthens a path only by the order of (g d)²/24.
//!
//! Amplitudes may follow too. A face of given velocity emits in proportion to the density, which goes as c^-2 in a gas of one pressure, and along
//! a ray the amplitude goes as the root of ρc (Pierce, *Acoustics*, section 8-5): c^-3/2 at the element and c^-1/2 at the receiver. Elements
//! whose output warmth hardly changes grade them less, so that both are tried.

use fieldgap_acoustics::{Element, Propagation, Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct TemperatureGradient;

/// The choice of amplitudes that follow the air.
const WITH_AMPLITUDES: Choice = Choice::Law(1);

/// Exponents by which an amplitude follows the speed of sound at the element and at the receiver.
const AT_ELEMENT: f64 = -1.5;
const AT_RECEIVER: f64 = -0.5;

/// The speed of sound at a place over that at the origin.
fn speed_ratio(values: &[f64], at_m: &Vec3) -> f64 {
    /// As far as the paths go: beyond, a gradient of this size is no air.
    const LEAST: f64 = 0.1;
    (1.0 + Vec3::from_column_slice(values).dot(at_m)).max(LEAST)
}

impl Effect for TemperatureGradient {
    fn id(&self) -> EffectId {
        EffectId::TemperatureGradient
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
            Parameter { neutral: 0.0, scale: 0.01, least: -2.0, most: 2.0 },
        ]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed, EffectId::AxisScale],
            independent_check: Some(
                "two thermometers, one at the array and one at the far end of the scan, show a gradient of temperature",
            ),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "the simulators model still air of one temperature only; keep draughts and heat sources away",
        )
    }

    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), WITH_AMPLITUDES]
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        if *at.choice == WITH_AMPLITUDES {
            for element in elements {
                element.amplitude *= speed_ratio(at.values, &element.centre_m).powf(AT_ELEMENT);
            }
        }
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        if *at.choice == WITH_AMPLITUDES {
            for (pressure, at_m) in pressures.iter_mut().zip(field.points_m()) {
                let factor = speed_ratio(at.values, at_m).powf(AT_RECEIVER);
                pressure.coherent *= factor;
                pressure.speckle *= factor * factor;
                pressure.speckle_square *= factor * factor;
            }
        }
    }

    fn air(&self, at: Setting<'_>, _speed_m_s: f64, air: &mut Propagation) {
        air.gradient_per_m += Vec3::from_column_slice(at.values);
    }

    fn describe(&self, fitted: &[Estimate], choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z] = [fitted[0], fitted[1], fitted[2]];
        // dc/c = dT / 2T at 293 K.
        let kelvin_m = |g: f64| g * 2.0 * 293.15;
        let sentence = format!(
            "the speed of sound changes through the field by {:.1} % a metre along x, {:.1} along y, {:.1} along z: \
             {:.0}, {:.0} and {:.0} kelvin a metre{}",
            100.0 * x.value,
            100.0 * y.value,
            100.0 * z.value,
            kelvin_m(x.value),
            kelvin_m(y.value),
            kelvin_m(z.value),
            if *choice == WITH_AMPLITUDES {
                "; amplitudes follow the density of the air"
            } else {
                ""
            }
        );
        Finding::new([("gx", x.real()), ("gy", y.real()), ("gz", z.real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_gradient_of_the_speed_of_sound_is_that_of_the_air() {
        let bench = Bench::new();
        let mut air = Propagation::default();
        TemperatureGradient.air(bench.at(&[0.1, -0.2, 0.3]), 343.0, &mut air);
        assert_eq!(air.gradient_per_m, Vec3::new(0.1, -0.2, 0.3));
    }

    #[test]
    fn amplitudes_follow_the_density_and_the_root_of_the_impedance() {
        let bench = Bench::new();
        let values = [0.5, 0.0, 0.0];
        let element = |choice: &Choice| {
            let mut element = [Element::at(0.02, 0.0)];
            let before = element[0].amplitude;
            TemperatureGradient.elements(Setting { choice, ..bench.at(&values) }, &mut element);
            element[0].amplitude / before
        };
        assert_eq!(element(&Choice::Law(0)), 1.0);
        assert!((element(&WITH_AMPLITUDES) - 1.01f64.powf(-1.5)).abs() < 1e-12);
    }
}
