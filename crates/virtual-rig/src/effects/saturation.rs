//! Soft compression at high level: v / √(1 + (v/level)²), which loses 3 dB where v = level.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Saturation {
    /// The reading, had it not been compressed, at which 3 dB are lost, V.
    level: Positive,
}

impl Effect for Saturation {
    fn level_v(&self, level_v: f64, _time_s: f64) -> f64 {
        level_v / (1.0 + (level_v / self.level.get()).powi(2)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn three_decibels_are_lost_at_the_level_and_nothing_far_below() {
        let effect = effect::<Saturation>("level = 2.0");
        assert!((effect.level_v(2.0, 0.0) / 2.0 - 0.5f64.sqrt()).abs() < 1e-12);
        assert!((effect.level_v(0.01, 0.0) / 0.01 - 1.0).abs() < 1e-4);
        assert!(effect.level_v(1e6, 0.0) <= 2.0);
    }
}
