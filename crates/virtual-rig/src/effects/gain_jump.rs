//! The level jumps at one moment: a loose plug, or an amplifier that changes its range.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::{Finite, Time};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GainJump {
    /// Time from power-up to the jump, s.
    at_s: Time,
    /// Level after over level before, minus one.
    relative: Finite,
}

impl Effect for GainJump {
    fn level_v(&self, level_v: f64, time_s: f64) -> f64 {
        if time_s < self.at_s.get() { level_v } else { level_v * (1.0 + self.relative.get()) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_level_is_another_from_one_moment_on() {
        let jump: GainJump = effect("at_s = 100.0\nrelative = -0.2");
        assert_eq!(jump.level_v(1.0, 99.9), 1.0);
        assert_eq!(jump.level_v(1.0, 100.0), 0.8);
    }
}
