//! How the rates of a set move as limits of the diagnosis are varied.

use std::fmt::Write as _;
use std::path::Path;

use fieldgap_text::significant;
use serde::Serialize;

use super::super::answer::Answers;
use super::super::error::BlindError;
use super::super::parsed_diagnosis::ParsedDiagnosis;
use super::{Rate, Score, diagnoses_in};

/// The rates with every limit as it is, and with each varied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moves {
    /// Scans that were diagnosed with every limit as it is.
    pub scans: usize,
    /// The rates that have a target, of those kinds of scans that the set has.
    pub rates: Vec<Rate>,
    /// What each variation changes.
    pub varied: Vec<Move>,
    #[serde(skip)]
    diagnoses: Vec<Option<ParsedDiagnosis>>,
}

/// What a variation of one limit changes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Move {
    /// The limit.
    pub limit: String,
    /// Its usual value.
    pub usual: f64,
    /// Its value in this variation.
    pub value: f64,
    /// Scans for which another verdict is given, or other causes are named.
    pub changed: Vec<String>,
    /// The same rates as those with every limit as it is.
    pub rates: Vec<Rate>,
}

impl Moves {
    /// The rates of the diagnoses in a folder, with every limit as it is.
    ///
    /// # Errors
    /// [`BlindError`] if there is none, or one cannot be read.
    pub fn from(answers: &Answers, diagnoses: &Path) -> Result<Self, BlindError> {
        let diagnoses = diagnoses_in(answers, diagnoses)?;
        let mut rates = Score::new(answers, &diagnoses).rates;
        rates.retain(|rate| rate.of > 0 && rate.target.is_some());
        let scans = diagnoses.iter().flatten().count();
        Ok(Self { scans, rates, varied: Vec::new(), diagnoses })
    }

    /// Adds the diagnoses in a folder, made with a limit at another value.
    ///
    /// # Errors
    /// [`BlindError`] if there is none, or one cannot be read.
    pub fn add(
        &mut self,
        (limit, usual, value): (&str, f64, f64),
        answers: &Answers,
        diagnoses: &Path,
    ) -> Result<(), BlindError> {
        let diagnoses = diagnoses_in(answers, diagnoses)?;
        let mut rates = Score::new(answers, &diagnoses).rates;
        rates.retain(|rate| self.rates.iter().any(|before| before.what == rate.what));
        let both = answers.answers.iter().zip(self.diagnoses.iter().zip(&diagnoses));
        let said = |diagnosis: &Option<ParsedDiagnosis>| {
            diagnosis.as_ref().map(|diagnosis| (diagnosis.verdict, diagnosis.named()))
        };
        let changed = both.filter(|(_, (before, now))| said(before) != said(now));
        let changed = changed.map(|(answer, _)| answer.name.clone()).collect();
        self.varied.push(Move { limit: limit.to_owned(), usual, value, changed, rates });
        Ok(())
    }

    /// As a table: a row for each variation, a column for each rate.
    pub fn to_text(&self) -> String {
        let mut text = format!("{} scans, with every limit as it is:\n\n", self.scans);
        for (rate, letter) in self.rates.iter().zip('A'..) {
            let _ =
                writeln!(text, "  {letter}  {:<66}  {:>4} of {}", rate.what, rate.count, rate.of);
        }
        let _ =
            write!(text, "\n{:<22}  {:>12}  {:>12}  {:>7}", "limit", "usual", "varied", "changed");
        for (_, letter) in self.rates.iter().zip('A'..) {
            let _ = write!(text, "  {letter:>7}");
        }
        text += "\n";
        for Move { limit, usual, value, changed, rates } in &self.varied {
            let [usual, value] = [usual, value].map(|value| significant(*value, 3));
            let _ = write!(text, "{limit:<22}  {usual:>12}  {value:>12}  {:>7}", changed.len());
            for (rate, before) in rates.iter().zip(&self.rates) {
                let by = rate.count as i64 - before.count as i64;
                let by = match (rate.of == before.of, by) {
                    (false, _) => format!("{}/{}", rate.count, rate.of),
                    (true, 0) => "0".to_owned(),
                    (true, by) => format!("{by:+}"),
                };
                let _ = write!(text, "  {by:>7}");
            }
            text += "\n";
        }
        text += "\nchanged: scans with another verdict, or for which other causes are named. Under each letter: by how many scans its count moves,\n\
                 or the new count where it is of another number of scans.\n";
        text
    }
}
