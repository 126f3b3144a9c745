//! The exposure of people by what a page asks for: foreseen by whoever serves the rig, and accepted by a person before a real array sounds.

use std::any::Any;

use serde::{Deserialize, Serialize};

use crate::refusal::Refusal;
use fieldgap_acoustics::Excitation;
use fieldgap_acquisition::{PlannedScan, RigSetup};

/// What is foreseen of the exposure of people.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Foresight {
    /// Levels, limits and times, as text.
    pub text: String,
    /// What speaks against a start, a sentence each.
    pub concerns: Vec<String>,
    /// Whether the array makes sound. A virtual one may always start.
    pub heard: bool,
}

/// Foresees exposures, and keeps the time with the array driven.
pub trait Exposing: Send + Sync {
    /// The exposure by a scan; `None` if the rig file states no places.
    ///
    /// # Errors
    /// It cannot be foreseen: why, in words.
    fn by_scan(&self, scan: &PlannedScan) -> Result<Option<Foresight>, String>;

    /// The exposure by drives, one after another, for a time in s if it is known; `None` if the rig file states no places.
    ///
    /// # Errors
    /// It cannot be foreseen: why, in words.
    fn by_drives(
        &self,
        setup: &RigSetup,
        drives: &[Excitation],
        seconds: Option<f64>,
    ) -> Result<Option<Foresight>, String>;

    /// Begins a time with the array driven by hand, which ends when the result is dropped.
    fn sounds(&self, setup: &RigSetup) -> Box<dyn Any + Send>;
}

/// The concerns that a person has read and accepted, as they were shown.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub(crate) struct Accepted(Vec<String>);

impl Accepted {
    /// Checks that nothing speaks against a start that was not accepted; whether a limit is exceeded, or not shown to be kept, all the same.
    ///
    /// # Errors
    /// Something does: the refusal has all concerns.
    pub fn covers(&self, foresight: Option<&Foresight>) -> Result<bool, Refusal> {
        let Some(foresight) = foresight.filter(|foresight| foresight.heard) else {
            return Ok(false);
        };
        match foresight.concerns.iter().all(|concern| self.0.contains(concern)) {
            true => Ok(!foresight.concerns.is_empty()),
            false => Err(Refusal::exposes(&foresight.concerns)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_concern_of_a_real_array_must_have_been_accepted() {
        let foresight = |concerns: &[&str], heard| Foresight {
            text: String::new(),
            concerns: concerns.iter().map(|&concern| concern.to_owned()).collect(),
            heard,
        };
        let accepted = |concerns: &[&str]| Accepted(foresight(concerns, true).concerns);
        let loud = foresight(&["head: 112 dB", "too long"], true);
        for too_little in [&[][..], &["head: 112 dB"], &["head: 111 dB", "too long"]] {
            let refusal = accepted(too_little).covers(Some(&loud)).expect_err("not all");
            assert!(refusal.problem.contains("head: 112 dB; too long"), "{refusal:?}");
        }
        let all = accepted(&["too long", "head: 112 dB", "of another day"]);
        assert_eq!(all.covers(Some(&loud)), Ok(true));
        assert_eq!(all.covers(Some(&foresight(&[], true))), Ok(false));
        assert_eq!(accepted(&[]).covers(Some(&foresight(&["head: 112 dB"], false))), Ok(false));
        assert_eq!(accepted(&[]).covers(None), Ok(false));
    }
}
