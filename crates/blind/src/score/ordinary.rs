//! Effects of which every set-up has a little: whether one is named with about the size that it has.

use serde_json::Value;

use super::super::answer::Imperfections;
use super::super::parsed_diagnosis::{ParsedCandidate, ParsedParameter};

/// Named with more than this times its true size, what is ordinary is a cause after all.
const TWICE: f64 = 2.0;

/// Whether the set-up has some of this effect.
pub(super) fn has(anyway: &Imperfections, effect: &str) -> bool {
    let of_effect = |name: &String| name.split('.').next() == Some(effect);
    anyway.parameters.keys().any(of_effect)
}

/// Whether a candidate states at most twice the size that an effect has in the set-up.
pub(super) fn is_of_its_size(
    anyway: &Imperfections,
    effect: &str,
    candidate: &ParsedCandidate,
) -> bool {
    let true_size = size(effect, anyway.stated_speed_m_s, |name| {
        anyway.parameters.get(name).map(numbers).unwrap_or_default()
    });
    let stated_size = size(effect, anyway.stated_speed_m_s, |name| {
        candidate.parameters.get(name).map(fitted).unwrap_or_default()
    });
    match (true_size, stated_size) {
        (Some(truly), Some(stated)) => stated <= TWICE * truly,
        _ => false,
    }
}

/// The size of an effect by its parameters; `None` if one is missing.
fn size(effect: &str, stated_speed_m_s: f64, of: impl Fn(&str) -> Vec<f64>) -> Option<f64> {
    let norm = |names: &[&str], count: usize| {
        let values: Vec<f64> =
            names.iter().flat_map(|name| of(&format!("{effect}.{name}"))).collect();
        let norm = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        (values.len() == count).then_some(norm)
    };
    match effect {
        "sound-speed" => norm(&["c_m_s"], 1).map(|c_m_s| (c_m_s - stated_speed_m_s).abs()),
        "element-gain" => norm(&["spread"], 1),
        "element-phase" => norm(&["spread_rad"], 1),
        "offset" => norm(&["x_mm", "y_mm", "z_mm"], 3),
        "gain-drift" => norm(&["relative"], 1),
        "reflection" => norm(&["coefficient"], 2),
        _ => None,
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().filter_map(Value::as_f64).collect(),
        single => single.as_f64().into_iter().collect(),
    }
}

fn fitted(parameter: &ParsedParameter) -> Vec<f64> {
    match parameter {
        ParsedParameter::Real { value, .. } => vec![*value],
        ParsedParameter::Complex { value, .. } => value.to_vec(),
        ParsedParameter::Other(other) => other.get("value").map(numbers).unwrap_or_default(),
    }
}
