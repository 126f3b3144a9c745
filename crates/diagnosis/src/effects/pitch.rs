//! The array is larger or smaller than modelled; the delays were computed for the modelled one.

use fieldgap_acoustics::{Element, Simulator};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::remedy::{Remedy, SetupKey};

/// The effect.
pub(crate) struct Pitch;

impl Effect for Pitch {
    fn id(&self) -> EffectId {
        EffectId::Pitch
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 1.0, scale: 0.001, least: 0.85, most: 1.18 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed],
            independent_check: Some("callipers measure the distance between the elements"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Key(SetupKey::Pitch)
    }

    fn starts(&self, _context: &Context) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![0.95], vec![1.05]]
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        for element in elements {
            element.centre_m.x *= at.values[0];
            element.centre_m.y *= at.values[0];
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let sentence = format!(
            "the elements are {:.4} ± {:.4} times as far apart as modelled",
            fitted[0].value, fitted[0].error
        );
        Finding::new([("ratio", fitted[0].real())], sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use fieldgap_acoustics::Vec3;

    #[test]
    fn the_elements_move_away_from_the_centre() {
        let bench = Bench::new();
        let mut elements = [Element::at(0.01, -0.02)];
        Pitch.elements(bench.at(&[1.1]), &mut elements);
        assert!((elements[0].centre_m - Vec3::new(0.011, -0.022, 0.0)).norm() < 1e-12);
    }
}
