//! Calibration of the stated standard errors: nineteen in twenty true values should lie within two of them.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::Serialize;

use super::super::parsed_diagnosis::ParsedParameter;
use super::judged::Judged;
use super::rate::{Rate, Target};

/// One parameter over all diagnoses whose first candidate is the truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterScore {
    /// `effect.parameter`; both parts of a complex one count.
    pub parameter: String,
    /// Number of values.
    pub of: usize,
    /// Number of values within two standard errors of the truth.
    pub within_two: usize,
    /// Mean of (fitted - true) / standard error.
    pub mean_z: f64,
    /// Root mean square of the same.
    pub rms_z: f64,
}

impl ParameterScore {
    /// Every parameter that was fitted with an error, by name.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut deviations: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for one in judged {
            let Some(first) = one.first().filter(|first| one.is_true(&first.effects)) else {
                continue;
            };
            for (name, fitted) in &first.parameters {
                let truth = one.answer.parameters.get(name);
                let z = truth.map_or(Vec::new(), |truth| z_scores(name, fitted, truth));
                deviations.entry(name).or_default().extend(z);
            }
        }
        deviations
            .into_iter()
            .filter(|(_, z)| !z.is_empty())
            .map(|(parameter, z)| Self {
                parameter: parameter.to_owned(),
                of: z.len(),
                within_two: z.iter().filter(|z| z.abs() <= 2.0).count(),
                mean_z: z.iter().sum::<f64>() / z.len() as f64,
                rms_z: (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt(),
            })
            .collect()
    }
}

/// Over all parameters.
pub(super) fn overall(scores: &[ParameterScore], target: Target) -> Rate {
    let count = scores.iter().map(|score| score.within_two).sum();
    let of = scores.iter().map(|score| score.of).sum();
    Rate::counted("parameters within two standard errors", count, of).with(target)
}

/// In standard errors; phases without their whole turns.
fn z_scores(name: &str, fitted: &ParsedParameter, truth: &serde_json::Value) -> Vec<f64> {
    let deviation = |value: f64, truth: f64| match name.ends_with(".phase_rad") {
        true => (value - truth) - TAU * ((value - truth) / TAU).round(),
        false => value - truth,
    };
    let z = |value: f64, error: Option<f64>, truth: Option<f64>| {
        let error = error.filter(|error| *error > 0.0)?;
        Some(deviation(value, truth?) / error)
    };
    match fitted {
        ParsedParameter::Real { value, standard_error } => {
            z(*value, *standard_error, truth.as_f64()).into_iter().collect()
        }
        ParsedParameter::Complex { value, standard_error } => (0..2)
            .filter_map(|part| {
                let truth = truth.get(part).and_then(serde_json::Value::as_f64);
                z(value[part], standard_error[part], truth)
            })
            .collect(),
        ParsedParameter::Other(_) => Vec::new(),
    }
}
