//! What is true of one scan of a set, as it is sealed away.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::assignment::Category;

/// What is true of one scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The scan's folder.
    pub name: String,
    /// What kind of truth it has.
    pub category: Category,
    /// Ids of the catalogue, in its order; or the one name of a cause outside it.
    pub effects: Vec<String>,
    /// Parameters by `effect.parameter`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// The gap without noise, at the best gain and a small shift: rms over readings in standard deviations of their noise.
    pub gap_sigma: f64,
    /// The same for each effect alone, in the order of `effects`.
    pub gaps_alone_sigma: Vec<f64>,
    /// Amplitude and phase, rad, that each element truly has, where an effect changed any.
    pub elements: Option<Vec<[f64; 2]>>,
    /// Noise: relative, and of each quadrature, V.
    pub noise: [f64; 2],
    /// The largest reading that the laboratory expects, V.
    pub peak_v: f64,
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
