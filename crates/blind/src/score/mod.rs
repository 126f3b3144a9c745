//! Compares diagnoses with the true causes.
//!
//! Rates are given for ranges of the gap, in standard deviations of a reading's noise. Each has its 95 % interval, and some have
//! a target.

mod calibration;
mod confusion;
mod judged;
mod measurement;
mod moves;
mod ordinary;
mod parameters;
mod rate;
mod rates;
mod strata;
mod targets;
mod text;

use std::path::Path;

use serde::Serialize;

use super::answer::{Answer, Answers};
use super::error::BlindError;
use super::parsed_diagnosis::ParsedDiagnosis;
use super::run::diagnosis_of;
pub use calibration::{Calibration, CalibrationBin};
pub use confusion::{ConfusionRow, VerdictRow};
use judged::Judged;
pub use moves::{Move, Moves};
pub use parameters::ParameterScore;
pub use rate::{Figure, Rate, Target};
pub use strata::StratumScore;
use targets::Targets;

/// A set's score.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Scans with a diagnosis.
    pub scored: usize,
    /// Scans without one.
    pub not_diagnosed: Vec<String>,
    /// Verdicts by category.
    pub verdicts: Vec<VerdictRow>,
    /// Rates, with targets where there are any.
    pub rates: Vec<Rate>,
    /// Figures that are not rates.
    pub figures: Vec<Figure>,
    /// What was named for each set of true causes.
    pub confusion: Vec<ConfusionRow>,
    /// Calibration of the stated probabilities.
    pub calibration: Calibration,
    /// Calibration of the stated standard errors, for each parameter.
    pub parameters: Vec<ParameterScore>,
    /// The rates by the classes of laboratories; empty for the bench.
    pub strata: Vec<StratumScore>,
}

impl Score {
    /// Scores the diagnoses in a folder.
    ///
    /// # Errors
    /// [`BlindError`] if there is none, or one cannot be read.
    pub fn of_folder(answers: &Answers, diagnoses: &Path) -> Result<Self, BlindError> {
        Ok(Self::new(answers, &diagnoses_in(answers, diagnoses)?))
    }

    /// Scores diagnoses, one for each answer where there is one.
    pub fn new(answers: &Answers, diagnoses: &[Option<ParsedDiagnosis>]) -> Self {
        let both = || answers.answers.iter().zip(diagnoses);
        let judged: Vec<Judged<'_>> = both()
            .filter_map(|(answer, diagnosis)| {
                diagnosis.as_ref().map(|diagnosis| Judged::new(answer, diagnosis))
            })
            .collect();
        let missing = both().filter(|(_, diagnosis)| diagnosis.is_none());
        let calibration = Calibration::of(&judged);
        let parameters = ParameterScore::of_all(&judged);
        let targets = Targets::of(answers);
        let strata = StratumScore::of_all(&judged);
        let mut rates = rates::rates(&judged, targets);
        rates.push(parameters::overall(&parameters, targets.parameters));
        rates.extend(measurement::proven(&judged));
        rates.extend(measurement::inseparable(&judged));
        Self {
            scored: judged.len(),
            not_diagnosed: missing.map(|(answer, _)| answer.name.clone()).collect(),
            verdicts: VerdictRow::of_all(&judged),
            rates,
            figures: [rates::median_explained(&judged), calibration.figure(targets.calibration)]
                .into_iter()
                .chain(StratumScore::worst_calibration(&strata, targets.calibration))
                .chain(measurement::medians(&judged))
                .collect(),
            confusion: ConfusionRow::of_all(&judged),
            calibration,
            parameters,
            strata,
        }
    }
}

/// The diagnosis of each scan in a folder, where there is one.
fn diagnoses_in(
    answers: &Answers,
    folder: &Path,
) -> Result<Vec<Option<ParsedDiagnosis>>, BlindError> {
    let of = |answer: &Answer| {
        let path = diagnosis_of(folder, &answer.name);
        path.exists().then(|| ParsedDiagnosis::read(&path)).transpose()
    };
    let diagnoses: Vec<_> = answers.answers.iter().map(of).collect::<Result<_, _>>()?;
    match diagnoses.iter().all(Option::is_none) {
        true => Err(BlindError::NothingToScore(folder.to_owned())),
        false => Ok(diagnoses),
    }
}

#[cfg(test)]
mod tests;
