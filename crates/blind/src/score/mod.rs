//! Compares what diagnoses said with what was true.
//!
//! Rates are given by the size of the gap in standard deviations of a reading's noise and not as one average, each with its
//! 95 % interval and, where there is one, its target.

mod calibration;
mod confusion;
mod judged;
mod parameters;
mod rate;
mod rates;
mod text;

use std::path::Path;

use serde::Serialize;

use super::answer::Answers;
use super::error::BlindError;
use super::run::diagnosis_of;
use super::said::Said;
pub use calibration::{Calibration, CalibrationBin};
pub use confusion::{ConfusionRow, VerdictRow};
use judged::Judged;
pub use parameters::ParameterScore;
pub use rate::{Figure, Rate, Target};

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
    /// Figures that are no rates.
    pub figures: Vec<Figure>,
    /// What was named, by what was true.
    pub confusion: Vec<ConfusionRow>,
    /// How far the stated probabilities hold.
    pub calibration: Calibration,
    /// How far the stated standard errors hold, parameter by parameter.
    pub parameters: Vec<ParameterScore>,
}

impl Score {
    /// Scores the diagnoses that are kept in a folder.
    ///
    /// # Errors
    /// [`BlindError`] if there is none, or one cannot be read.
    pub fn of_folder(answers: &Answers, diagnoses: &Path) -> Result<Self, BlindError> {
        let mut said = Vec::new();
        for answer in &answers.answers {
            let path = diagnosis_of(diagnoses, &answer.name);
            said.push(if path.exists() { Some(Said::read(&path)?) } else { None });
        }
        if said.iter().all(Option::is_none) {
            return Err(BlindError::NothingToScore(diagnoses.to_owned()));
        }
        Ok(Self::new(answers, &said))
    }

    /// Scores diagnoses, one for each answer where there is one.
    pub fn new(answers: &Answers, said: &[Option<Said>]) -> Self {
        let both = || answers.answers.iter().zip(said);
        let judged: Vec<Judged<'_>> = both()
            .filter_map(|(answer, said)| said.as_ref().map(|said| Judged::new(answer, said)))
            .collect();
        let missing = both().filter(|(_, said)| said.is_none());
        let calibration = Calibration::of(&judged);
        let parameters = ParameterScore::of_all(&judged);
        let mut rates = rates::rates(&judged);
        rates.push(parameters::overall(&parameters));
        Self {
            scored: judged.len(),
            not_diagnosed: missing.map(|(answer, _)| answer.name.clone()).collect(),
            verdicts: VerdictRow::of_all(&judged),
            rates,
            figures: vec![rates::median_explained(&judged), calibration.figure()],
            confusion: ConfusionRow::of_all(&judged),
            calibration,
            parameters,
        }
    }
}

#[cfg(test)]
mod tests;
