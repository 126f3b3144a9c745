//! The reading lags the motion: it is that of the nozzle's position a moment earlier.
//!
//! A scan that dwells longer than this at each point shows nothing of it.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lag {
    /// The delay, s.
    s: NonNegative,
}

impl Effect for Lag {
    fn lag_s(&self) -> f64 {
        self.s.get()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_reading_is_late() {
        assert_eq!(effect::<Lag>("s = 0.02").lag_s(), 0.02);
    }
}
