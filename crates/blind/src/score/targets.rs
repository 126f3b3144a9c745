//! The required figures: of the bench, and of sets of laboratories.

use super::super::answer::Answers;
use super::rate::Target;

/// Those that differ between the two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Targets {
    /// Both of two effects exactly.
    pub pairs: Target,
    /// False alarms without any effect.
    pub alarms: Target,
    /// Calibration error of the stated probabilities.
    pub calibration: Target,
    /// Parameters within two standard errors.
    pub parameters: Target,
    /// Causes outside of the catalogue, of a clear gap, that are not explained.
    pub outside_not_explained: Option<Target>,
}

impl Targets {
    /// Those of a set.
    pub fn of(answers: &Answers) -> Self {
        match answers.answers.iter().all(|answer| answer.strata.is_empty()) {
            true => Self {
                pairs: Target::AtLeast(0.8),
                alarms: Target::AtMost(0.01),
                calibration: Target::AtMost(0.05),
                parameters: Target::Within(0.9, 0.98),
                outside_not_explained: None,
            },
            false => Self {
                pairs: Target::AtLeast(0.85),
                // One of 300, with room for rounding.
                alarms: Target::AtMost(0.0034),
                calibration: Target::AtMost(0.04),
                parameters: Target::Within(0.93, 0.97),
                outside_not_explained: Some(Target::AtLeast(0.95)),
            },
        }
    }
}
