//! Steps a millimetre are wrong: a commanded millimetre is truly this long, about the array's centre.
//!
//! A controller has a number of steps for each axis. Either one of them is wrong, or each axis has a length of its own: all are tried.

use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_text::listed;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Stage, Timing,
};
use crate::model::instance::Setting;
use crate::model::observations::{Observations, Visit};
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct AxisScale;

/// Each axis has a length of its own.
const EACH_AXIS: Choice = Choice::Law(0);

/// The axes in the order of the choices after that.
const AXES: [&str; 3] = ["x", "y", "z"];

/// True length of a commanded millimetre, mm.
const LENGTH: Parameter = Parameter { neutral: 1.0, scale: 0.001, least: 0.9, most: 1.1 };

/// The one axis that is wrong, by its number.
fn one_axis(choice: &Choice) -> Option<usize> {
    match *choice {
        Choice::Law(law @ 1..=3) => Some(usize::from(law) - 1),
        _ => None,
    }
}

/// The lengths along all axes.
fn lengths(choice: &Choice, values: &[f64]) -> Vec3 {
    match one_axis(choice) {
        Some(axis) => Vec3::from_fn(|number, _| if number == axis { values[0] } else { 1.0 }),
        None => Vec3::from_column_slice(values),
    }
}

impl Effect for AxisScale {
    fn id(&self) -> EffectId {
        EffectId::AxisScale
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[LENGTH; 3]
    }

    fn parameters_of(&self, choice: &Choice) -> &'static [Parameter] {
        if one_axis(choice).is_some() { &[LENGTH] } else { self.parameters() }
    }

    fn choices(&self) -> Vec<Choice> {
        let of_one = (1..=3).map(Choice::Law);
        [EACH_AXIS].into_iter().chain(of_one).collect()
    }

    /// Of lengths of all axes that of the one, and back.
    fn carried(&self, values: Vec<f64>, choice: &Choice) -> Vec<f64> {
        match (one_axis(choice), values.as_slice()) {
            (Some(axis), [_, _, _]) => vec![values[axis]],
            (Some(_), _) | (None, [_, _, _]) => values,
            // Which axis it was is not known here.
            (None, _) => self.neutral(),
        }
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[EffectId::SoundSpeed, EffectId::DriveFrequency],
            independent_check: Some("a ruler beside the robot measures its travel"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("correct the steps per millimetre in the robot's firmware")
    }

    fn can_act(&self, observations: &Observations) -> bool {
        observations.tell_axes()
    }

    fn position(&self, at: Setting<'_>, _visit: &Visit, at_m: Vec3) -> Vec3 {
        at_m.component_mul(&lengths(at.choice, at.values))
    }

    fn describe(&self, fitted: &[Estimate], choice: &Choice, _believed: &Context) -> Finding {
        let names = one_axis(choice).map_or(AXES.as_slice(), |axis| &AXES[axis..=axis]);
        let lengths = names.iter().zip(fitted).enumerate().map(|(n, (name, fitted))| {
            let unit = if n == 0 { " mm" } else { "" };
            format!("{:.4} ± {:.4}{unit} along {name}", fitted.value, fitted.error)
        });
        let lengths: Vec<String> = lengths.collect();
        let sentence = format!("a commanded millimetre is {}", listed(&lengths));
        let parameters = names.iter().zip(fitted).map(|(name, fitted)| (*name, fitted.real()));
        Finding::new(parameters, sentence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, visit};

    #[test]
    fn each_axis_is_stretched_about_the_centre_of_the_array() {
        let bench = Bench::new();
        let at_m =
            AxisScale.position(bench.at(&[1.1, 0.9, 1.0]), &visit(), Vec3::new(0.01, 0.01, 0.1));
        assert!((at_m - Vec3::new(0.011, 0.009, 0.1)).norm() < 1e-12);
    }

    #[test]
    fn one_axis_alone_leaves_the_others_as_they_are() {
        let bench = Bench::new();
        let of_y = Choice::Law(2);
        let values = AxisScale.carried(vec![1.1, 0.9, 1.0], &of_y);
        assert_eq!(values, [0.9]);
        let setting = Setting { choice: &of_y, ..bench.at(&values) };
        let at_m = AxisScale.position(setting, &visit(), Vec3::new(0.01, 0.01, 0.1));
        assert!((at_m - Vec3::new(0.01, 0.009, 0.1)).norm() < 1e-12);
        let told =
            AxisScale.describe(&[Estimate { value: 0.9, error: 0.001 }], &of_y, &bench.context);
        assert_eq!(told.sentence, "a commanded millimetre is 0.9000 ± 0.0010 mm along y");
        assert_eq!(told.parameters.keys().copied().collect::<Vec<_>>(), ["y"]);
    }
}
