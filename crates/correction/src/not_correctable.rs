//! Effects that no set-up file has a key for.

use fieldgap_diagnosis::EffectId;
use serde::{Deserialize, Serialize};

/// A named effect that was not written, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unwritten {
    /// The effect.
    pub effect: EffectId,
    /// The reason, and what to do instead.
    pub why: String,
}

impl std::fmt::Display for Unwritten {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.effect, self.why)
    }
}

impl Unwritten {
    pub(super) fn new(effect: EffectId, why: impl Into<String>) -> Self {
        Self { effect, why: why.into() }
    }
}
