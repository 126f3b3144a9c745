//! What a diagnosis said, as far as a score needs it, read back from its JSON.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::error::BlindError;

/// The judgement.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize, serde::Serialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum SaidVerdict {
    /// One set of effects.
    Explained,
    /// Two or three sets.
    Ambiguous,
    /// A gap without a cause in the catalogue.
    Unexplained,
    /// No gap.
    None,
}

/// A diagnosis. Fields that a score does not need are left where they are.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Said {
    /// The judgement.
    pub verdict: SaidVerdict,
    /// The named effects.
    #[serde(default)]
    pub effects: Vec<String>,
    /// The rival sets.
    #[serde(default)]
    pub alternatives: Vec<Vec<String>>,
    /// The candidates, the most probable first.
    #[serde(default)]
    pub ranked: Vec<SaidCandidate>,
    /// Gap of the simulation as believed, relative to the scan's rms.
    #[serde(default)]
    pub gap_before: Option<f64>,
    /// Share of the squared gap beyond noise that was closed.
    #[serde(default)]
    pub explained_fraction: Option<f64>,
}

/// A candidate.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct SaidCandidate {
    /// Its effects; none is "no effect".
    pub effects: Vec<String>,
    /// Its probability.
    pub probability: f64,
    /// Its parameters by `effect.parameter`.
    #[serde(default)]
    pub parameters: BTreeMap<String, SaidParameter>,
}

/// A fitted parameter; numbers that are not finite are `null` in JSON.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum SaidParameter {
    /// A number.
    Real {
        /// Its value.
        value: f64,
        /// Its standard error.
        standard_error: Option<f64>,
    },
    /// A complex number.
    Complex {
        /// Real and imaginary part.
        value: [f64; 2],
        /// Their standard errors.
        standard_error: [Option<f64>; 2],
    },
    /// Anything that has no error: elements, or a number that could not be told.
    Other(serde_json::Value),
}

impl Said {
    /// Reads a diagnosis.
    ///
    /// # Errors
    /// [`BlindError`] if the file cannot be read, or is no diagnosis.
    pub fn read(path: &Path) -> Result<Self, BlindError> {
        let help = "run `fieldgap blind run` on this scan again";
        let bytes = std::fs::read(path).map_err(BlindError::reading(path, help))?;
        serde_json::from_slice(&bytes).map_err(|source| {
            let path = path.to_owned();
            BlindError::Json { path, source, help }
        })
    }

    /// What was named, in a few words: an effect or several, rivals with a bar between them, or the verdict itself.
    pub fn named(&self) -> String {
        match self.verdict {
            SaidVerdict::Explained => label(&self.effects),
            SaidVerdict::Ambiguous => {
                let rivals: Vec<String> = self.alternatives.iter().map(|set| label(set)).collect();
                rivals.join(" | ")
            }
            SaidVerdict::Unexplained => "unexplained".to_owned(),
            SaidVerdict::None => "none".to_owned(),
        }
    }
}

/// A set of effects in words.
pub(super) fn label(effects: &[String]) -> String {
    if effects.is_empty() { "none".to_owned() } else { effects.join(" + ") }
}

/// Whether two sets of effects are the same, in whatever order.
pub(super) fn same(one: &[String], other: &[String]) -> bool {
    one.len() == other.len() && one.iter().all(|effect| other.contains(effect))
}
