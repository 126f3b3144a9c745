//! The level settles after switching on: 1 + r exp(-t/τ), from time zero on. Before it, the level is that of time zero.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::{Finite, Positive};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WarmUp {
    /// Level at time zero over the settled one, minus one.
    relative: Finite,
    time_constant_s: Positive,
}

impl Effect for WarmUp {
    fn level_v(&self, level_v: f64, time_s: f64) -> f64 {
        let left = (-time_s.max(0.0) / self.time_constant_s.get()).exp();
        level_v * (1.0 + self.relative.get() * left).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_level_settles_with_its_time_constant() {
        let warm_up = effect::<WarmUp>("relative = 0.2\ntime_constant_s = 100.0");
        let at = |time_s: f64| warm_up.level_v(2.0, time_s);
        assert_eq!((at(0.0), at(-5.0)), (2.4, 2.4));
        assert!((at(100.0 * 2f64.ln()) - 2.2).abs() < 1e-12);
        assert!((at(1e5) - 2.0).abs() < 1e-12);
    }
}
