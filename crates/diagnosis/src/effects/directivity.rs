//! The elements' lobes are wider or narrower than modelled.
//!
//! Either every angle of the directivity is stretched, or the face is smaller, which stretches a piston's lobe in the sine of
//! the angle, or the lobe has a shape of its own, as a measured one has: all are tried.

use fieldgap_acoustics::Simulator;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Radiation, Stage,
    Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// The lobe has a shape of its own.
const OF_ANOTHER_SHAPE: Choice = Choice::Law(2);

/// Its width, and its shape by the factors of [`Shaped`](fieldgap_acoustics::transducer::Shaped): measured lobes take factors of ten of opposite
/// signs.
const SHAPED: [Parameter; 3] = [
    Parameter { neutral: 1.0, scale: 0.01, least: 0.4, most: 2.5 },
    Parameter { neutral: 0.0, scale: 0.05, least: -30.0, most: 30.0 },
    Parameter { neutral: 0.0, scale: 0.05, least: -30.0, most: 30.0 },
];

/// The effect.
pub(crate) struct Directivity;

impl Effect for Directivity {
    fn id(&self) -> EffectId {
        EffectId::Directivity
    }

    fn parameters(&self) -> &'static [Parameter] {
        &SHAPED[..1]
    }

    fn parameters_of(&self, choice: &Choice) -> &'static [Parameter] {
        if *choice == OF_ANOTHER_SHAPE { &SHAPED } else { self.parameters() }
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::ReceiverDirectivity, EffectId::Aperture],
            independent_check: Some(
                "one element alone, rotated in front of the receiver, shows its lobe (`fieldgap characterize`)",
            ),
        }
    }

    fn remedy(&self, simulator: Simulator) -> Remedy {
        match simulator {
            // A lobe wider by a ratio is that of a face smaller by it.
            Simulator::Piston => Remedy::Key(SetupKey::FaceRadius),
            _ => Remedy::Manual(
                "the lobe of this simulator is a fixed fit; only `piston` has a radius of the face to correct",
            ),
        }
    }

    fn choices(&self) -> Vec<Choice> {
        vec![Choice::Law(0), Choice::Law(1), OF_ANOTHER_SHAPE]
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.8], vec![1.3]]
    }

    fn radiation(&self, at: Setting<'_>, radiation: &mut Radiation<'_>) {
        radiation.width_ratio *= at.values[0];
        radiation.by_face = *at.choice == Choice::Law(1);
        if let [_, a, b] = *at.values {
            radiation.shape = [a, b];
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let width =
            format!("{:.3} ± {:.3} times as wide as modelled", fitted[0].value, fitted[0].error);
        let width_ratio = ("width_ratio", fitted[0].real());
        match fitted {
            [_, a, b] => Finding::new(
                [width_ratio, ("shape_2", a.real()), ("shape_4", b.real())],
                format!(
                    "the elements' lobes have another shape; by the level at 45°, they are {width}"
                ),
            ),
            _ => Finding::new([width_ratio], format!("the elements' lobes are {width}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, radiation};
    use fieldgap_acoustics::transducer::Transducer;
    use fieldgap_acoustics::transducer::Widened;

    /// A piston's first null, sin θ = 3.8317 / ka, moves to 1.3 times its angle or to 1.3 times its sine.
    #[test]
    fn a_wider_lobe_has_its_null_at_a_larger_angle_or_a_larger_sine() {
        let bench = Bench::new();
        let (radius_m, wavenumber) = (8e-3, 732.0);
        let null_rad = (3.831_706f64 / (radius_m * wavenumber)).asin();
        for (law, there_rad) in [(0, 1.3 * null_rad), (1, (1.3 * null_rad.sin()).asin())] {
            let mut radiation = radiation();
            let choice = Choice::Law(law);
            Directivity.radiation(Setting { choice: &choice, ..bench.at(&[1.3]) }, &mut radiation);
            let widened = Widened {
                transducer: radiation.transducer,
                ratio: radiation.width_ratio,
                by_face: radiation.by_face,
            };
            let at_null = widened.directivity(there_rad, radius_m, wavenumber);
            assert!(at_null.abs() < 1e-6, "{law}: {at_null}");
        }
    }
}
