//! The array's board is bowed: the height of its elements grows with the square of their distance from its centre, and their axes follow the
//! slope.

use fieldgap_acoustics::{Element, Simulator, Vec3};

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::Observations;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct BowedArray;

impl Effect for BowedArray {
    fn id(&self) -> EffectId {
        EffectId::BowedArray
    }

    /// Height of the outermost element over that of the centre, mm: above zero the array is a bowl.
    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { neutral: 0.0, scale: 0.02, least: -20.0, most: 20.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::ElementPhase],
            independent_check: Some("a straight edge across the array's face shows its bow"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual(
            "set-up files describe flat arrays; stiffen the board, or state the position of each element in its [[element]]",
        )
    }

    fn can_act(&self, observations: &Observations) -> bool {
        outermost_m(observations.first().believed.array.elements()) > 0.0
    }

    fn elements(&self, at: Setting<'_>, elements: &mut [Element]) {
        let rim_m = outermost_m(at.context.believed.array.elements());
        let curvature = 2e-3 * at.values[0] / (rim_m * rim_m);
        for element in elements {
            let across = Vec3::new(element.centre_m.x, element.centre_m.y, 0.0);
            element.centre_m.z += 0.5 * curvature * across.norm_squared();
            element.normal = (element.normal - curvature * across).normalize();
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let Estimate { value, error } = fitted[0];
        let shape = if value > 0.0 {
            "a bowl: its outermost elements stand"
        } else {
            "a dome: its outermost elements lie"
        };
        let side = if value > 0.0 { "above" } else { "below" };
        let sentence =
            format!("the array is {shape} {:.2} ± {error:.2} mm {side} its centre", value.abs());
        Finding::new([("sagitta_mm", fitted[0].real())], sentence)
    }
}

/// Distance of the outermost element from the centre, m.
fn outermost_m(elements: &[Element]) -> f64 {
    elements.iter().map(|element| element.centre_m.xy().norm()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::model::forward_model::ForwardModel;
    use crate::model::observations::Visit;
    use fieldgap_acoustics::{Excitation, Simulation};

    /// A bowl whose elements are driven alike focuses at its centre of curvature: half the square of the rim over the sagitta.
    #[test]
    fn a_bowl_focuses_at_its_centre_of_curvature() {
        let bench = Bench::new();
        let believed = Simulation { excitation: Excitation::Uniform, ..bench.believed().clone() };
        let rim_m = outermost_m(believed.array.elements());
        let (focal_m, bow) = (0.06, 1e3 * rim_m * rim_m / (2.0 * 0.06));
        let level = |model: &ForwardModel<'_>, x_m: f64| {
            let visit = Visit { at_m: Vec3::new(x_m, 0.0, focal_m), ..visit() };
            model.pressures_at(&believed, &[visit], &nuisance())[0].coherent.norm()
        };
        let bowl = bench.model(EffectId::BowedArray, &[bow]);
        let in_phase: f64 = believed
            .array
            .elements()
            .iter()
            .map(|e| 1.0 / (focal_m - 0.5e-3 * bow - e.centre_m.z))
            .sum();
        assert!(level(&bowl, 0.0) > 0.95 * in_phase, "{} {in_phase}", level(&bowl, 0.0));
        assert!(level(&bowl, 0.0) > 1.2 * level(&ForwardModel::believed(), 0.0));
        assert!(level(&bowl, 0.012) < 0.3 * level(&bowl, 0.0));
    }
}
