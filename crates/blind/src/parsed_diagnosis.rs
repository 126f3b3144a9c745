//! A diagnosis parsed from its JSON, as far as a score needs it.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use fieldgap_input::{MOST_TABLE, read_bytes};

use super::error::BlindError;

/// A verdict.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize, serde::Serialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum ParsedVerdict {
    /// One set of effects explains the gap.
    Explained,
    /// One set explains nearly all of the gap.
    MostlyExplained,
    /// Two or three sets explain it equally well.
    Ambiguous,
    /// No cause of the catalogue explains it.
    Unexplained,
    /// No gap.
    None,
}

/// A diagnosis. Fields that a score does not need are ignored.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ParsedDiagnosis {
    /// Its verdict.
    pub verdict: ParsedVerdict,
    /// The named effects.
    #[serde(default)]
    pub effects: Vec<String>,
    /// The alternative sets.
    #[serde(default)]
    pub alternatives: Vec<Vec<String>>,
    /// The candidates, the most probable first.
    #[serde(default)]
    pub ranked: Vec<ParsedCandidate>,
    /// Gap of the assumed simulation, relative to the scan's root mean square.
    #[serde(default)]
    pub gap_before: Option<f64>,
    /// Explained share of the squared gap beyond noise.
    #[serde(default)]
    pub explained_fraction: Option<f64>,
    /// What was measured for it, of a sealed rig.
    #[serde(default)]
    pub measurement: Option<ParsedMeasurement>,
}

/// What was measured for a diagnosis of a sealed rig.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ParsedMeasurement {
    /// Readings.
    pub readings: usize,
    /// Time on the rig's clock, s.
    pub seconds: f64,
    /// How the named cause did on fresh readings; `None` where it was not tested.
    #[serde(default)]
    pub verification: Option<ParsedVerification>,
    /// Whether the readings cannot tell the rivals apart, to first order; `None` without rivals, or where that is not known.
    #[serde(default)]
    pub rivals_alike: Option<bool>,
}

/// A cause held against fresh readings.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct ParsedVerification {
    /// Whether it holds.
    pub holds: bool,
}

/// A candidate.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ParsedCandidate {
    /// Its effects; none is "no effect".
    pub effects: Vec<String>,
    /// Its probability.
    pub probability: f64,
    /// Its parameters by `effect.parameter`.
    #[serde(default)]
    pub parameters: BTreeMap<String, ParsedParameter>,
}

/// A fitted parameter; numbers that are not finite are `null` in JSON.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum ParsedParameter {
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
    /// Anything without an error: elements, or a number that the data do not determine.
    Other(serde_json::Value),
}

impl ParsedDiagnosis {
    /// Reads a diagnosis.
    ///
    /// # Errors
    /// [`BlindError`] if the file cannot be read, or is no diagnosis.
    pub fn read(path: &Path) -> Result<Self, BlindError> {
        let help = "run `fieldgap blind run` on this scan again";
        let bytes = read_bytes(path, MOST_TABLE).map_err(BlindError::reading(path, help))?;
        serde_json::from_slice(&bytes).map_err(|source| {
            let path = path.to_owned();
            BlindError::Json { path, source, help }
        })
    }

    /// A short label: the named effects, alternatives separated by a bar, or the verdict itself.
    pub fn named(&self) -> String {
        match self.verdict {
            ParsedVerdict::Explained | ParsedVerdict::MostlyExplained => label(&self.effects),
            ParsedVerdict::Ambiguous => {
                let alternatives: Vec<String> =
                    self.alternatives.iter().map(|set| label(set)).collect();
                alternatives.join(" | ")
            }
            ParsedVerdict::Unexplained => "unexplained".to_owned(),
            ParsedVerdict::None => "none".to_owned(),
        }
    }
}

/// The label of a set of effects.
pub(super) fn label(effects: &[String]) -> String {
    if effects.is_empty() { "none".to_owned() } else { effects.join(" + ") }
}

/// Whether two sets of effects are equal in any order.
pub(super) fn same(one: &[String], other: &[String]) -> bool {
    one.len() == other.len() && one.iter().all(|effect| other.contains(effect))
}
