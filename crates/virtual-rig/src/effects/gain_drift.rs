//! The level drifts linearly in time, and stays constant after the drift has ended.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::{Finite, Time};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GainDrift {
    /// Last over first, minus one.
    relative: Finite,
    /// Time from power-up to the end of the drift (the length of the scan), s.
    over_s: Time,
}

impl Effect for GainDrift {
    fn level_v(&self, level_v: f64, time_s: f64) -> f64 {
        let share = (time_s / self.over_s.get()).clamp(0.0, 1.0);
        level_v * (1.0 + self.relative.get() * share).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_last_reading_over_the_first_is_one_and_the_drift() {
        let effect = effect::<GainDrift>("relative = -0.1\nover_s = 600.0");
        assert_eq!(effect.level_v(1.0, 0.0), 1.0);
        assert!((effect.level_v(1.0, 300.0) - 0.95).abs() < 1e-12);
        assert!((effect.level_v(1.0, 700.0) - 0.9).abs() < 1e-12);
    }
}
