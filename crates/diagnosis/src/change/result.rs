//! What a diagnosis of a change says, as data. It serialises to the JSON of format 1.

use std::collections::BTreeMap;

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Noise, Uncertain};
use serde::Serialize;

use crate::effect_id::EffectId;
use crate::fitted_parameter::FittedParameter;
use crate::result::ResidualTest;

/// What changed from record A to record B, as far as the readings tell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangeDiagnosis {
    /// The format of the JSON: 1.
    pub format: u32,
    /// The first record.
    pub a: RecordName,
    /// The second record.
    pub b: RecordName,
    /// The simulator that both are held against.
    pub simulator: Simulator,
    /// Unit of the readings of B.
    pub reading_unit: String,
    /// Pairs of readings at common places that were looked at.
    pub pairs: usize,
    /// Readings of B without a partner in A.
    pub left_out: usize,
    /// The judgement.
    pub verdict: ChangeVerdict,
    /// The judgement in one sentence.
    pub sentence: String,
    /// What changed, one id or two; empty unless the verdict is `explained` or `mostly-explained`.
    pub effects: Vec<EffectId>,
    /// The rivals, best first, where the verdict is `ambiguous`.
    pub alternatives: Vec<Vec<EffectId>>,
    /// Level of B over that of A, beside the best candidate.
    pub level: Uncertain,
    /// Rms of the change beyond noise, in standard deviations of one reading. Zero where nothing changed.
    pub size_in_sigma: f64,
    /// Mean squared difference of the pairs in units of its variance, if nothing changed: noise alone gives one.
    pub chi_square_unchanged: f64,
    /// The same if the level alone changed.
    pub chi_square_with_level: f64,
    /// The same with the best candidate.
    pub chi_square_after: f64,
    /// Share of the squared change beyond noise that the best candidate, its level included, explains on readings kept out of the fit; 0 to 1.
    pub explained_fraction: f64,
    /// Noise of one reading of B.
    pub noise: Noise,
    /// What both records have in common.
    pub common: CommonModel,
    /// Every set of effects worth a mention, the most probable first. An empty set is "the level alone".
    pub ranked: Vec<ChangeCandidate>,
    /// Tests for structure in what the best candidate leaves.
    pub residual_tests: Vec<ResidualTest>,
}

/// A record by its name and time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecordName {
    /// Name of the scan.
    pub name: String,
    /// When it was started, as in RFC 3339.
    pub recorded: String,
}

/// The judgement about a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChangeVerdict {
    /// Nothing changed beyond noise.
    None,
    /// The level changed, and nothing else.
    Level,
    /// One set of effects explains the change and its rivals do not; what is left is noise.
    Explained,
    /// One set of effects explains nearly all of the change; a small share is left that is not noise.
    MostlyExplained,
    /// Two or three sets explain it equally well.
    Ambiguous,
    /// Something changed, and nothing in the catalogue explains it.
    Unexplained,
}

impl ChangeVerdict {
    /// Whether one set of effects is named.
    pub fn names_a_cause(self) -> bool {
        matches!(self, Self::Explained | Self::MostlyExplained)
    }
}

/// What both records have in common: the model that was fitted to the first. It is held; what it leaves at a place is taken for common too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CommonModel {
    /// Effects that the model of A holds. They need not be true.
    pub effects: Vec<EffectId>,
    /// Mean squared residual of A in units of its variance, with the simulation as believed.
    pub chi_square_believed: f64,
    /// The same with the model.
    pub chi_square_fitted: f64,
}

/// A set of effects that may have changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangeCandidate {
    /// The ids; empty for "the level alone".
    pub effects: Vec<EffectId>,
    /// Probability among all that were tried, 0 to 1.
    pub probability: f64,
    /// Natural logarithm of the evidence, relative to the best.
    pub log_evidence: f64,
    /// What changed, by `effect.parameter`.
    pub parameters: BTreeMap<String, ParameterChange>,
    /// What the parameters mean, one clause an effect.
    pub readings: Vec<String>,
    /// Level of B over that of A beside these effects.
    pub level: Uncertain,
    /// Mean squared residual in units of its variance.
    pub chi_square: f64,
    /// Share of the squared change beyond noise that it explains on readings kept out of the fit; 0 to 1.
    pub explained_fraction: f64,
}

/// A parameter in A and in B.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterChange {
    /// In A: as believed, or as the model of A has it. `None` where it has no number there, as a level without saturation.
    pub before: Option<f64>,
    /// In B, or what B has and A has not, such as a list of silent elements. The standard error is that of the change.
    pub after: FittedParameter,
    /// The change with its standard error; `None` where there is no number before.
    pub change: Option<Uncertain>,
}

impl ChangeDiagnosis {
    /// The candidate with the most evidence.
    pub fn best(&self) -> Option<&ChangeCandidate> {
        self.ranked.first()
    }
}
