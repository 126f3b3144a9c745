//! The air becomes warmer or colder at a constant rate, from time zero on.
//!
//! c² is proportional to the absolute temperature (331.3 m/s at 273.15 K), so that a change of ΔT adds 331.3² ΔT/273.15 to it.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::Finite;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TemperatureDrift {
    /// Rate of the air's temperature, K/h.
    k_per_h: Finite,
}

impl Effect for TemperatureDrift {
    fn warmer_k(&self, time_s: f64) -> f64 {
        self.k_per_h.get() * time_s.max(0.0) / 3600.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_rate_is_that_of_an_hour_and_begins_at_zero() {
        let drift = effect::<TemperatureDrift>("k_per_h = -3.0");
        assert_eq!([-60.0, 0.0, 1200.0].map(|time_s| drift.warmer_k(time_s)), [0.0, 0.0, -1.0]);
    }
}
