//! The true causes of each scan of a set, as they are sealed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::assignment::Category;

/// The truth of one scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The scan's folder.
    pub name: String,
    /// Its category.
    pub category: Category,
    /// Ids of the catalogue, in its order; or the name of an unmodelled cause.
    pub effects: Vec<String>,
    /// Parameters by `effect.parameter`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// The gap without noise at the best gain and small shift: root mean square over the readings, in standard deviations of
    /// their noise.
    pub gap_sigma: f64,
    /// The same for each effect alone, in the order of `effects`.
    pub gaps_alone_sigma: Vec<f64>,
    /// True amplitude and phase, rad, of each element, if an effect changed any.
    pub elements: Option<Vec<[f64; 2]>>,
    /// Standard deviations of the noise: relative, and of each quadrature, V.
    pub noise: [f64; 2],
    /// The largest reading that the laboratory expects, V.
    pub peak_v: f64,
    /// Of a whole bench, the effect with the largest gap alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dominant: Option<String>,
    /// What the set-up has beside its causes, as every real one has; `None` for an ideal one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imperfections: Option<Imperfections>,
    /// The class of the laboratory on each axis by which scores are divided; empty for the bench.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub strata: BTreeMap<String, String>,
}

/// What a set-up has beside its causes. Gaps of causes are counted from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Imperfections {
    /// Parameters by `effect.parameter`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// The speed of sound that the set-up states, m/s: that of the truth is in the parameters.
    pub stated_speed_m_s: f64,
    /// The gap that they leave together, as that of an answer.
    pub gap_sigma: f64,
}

/// The truth of a whole set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    /// The format of this file: 1.
    pub format: u32,
    /// Seed of the set.
    pub seed: u64,
    /// One for each scan, by name.
    pub answers: Vec<Answer>,
}
