//! A floor that adds in power: √(v² + level²).

use serde::Deserialize;

use super::Effect;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseFloor {
    /// The reading of a silent field, V.
    level: NonNegative,
}

impl Effect for NoiseFloor {
    fn level_v(&self, level_v: f64, _time_s: f64) -> f64 {
        level_v.hypot(self.level.get())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn silence_reads_the_floor_and_powers_add() {
        let effect = effect::<NoiseFloor>("level = 0.3");
        assert_eq!(effect.level_v(0.0, 0.0), 0.3);
        assert!((effect.level_v(0.4, 0.0) - 0.5).abs() < 1e-12);
    }
}
