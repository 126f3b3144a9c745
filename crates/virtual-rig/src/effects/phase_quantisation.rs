//! The driver rounds the delay to some steps in a period.

use std::num::NonZeroU32;

use serde::Deserialize;

use super::Effect;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhaseQuantisation {
    /// Steps in one period.
    steps: NonZeroU32,
}

impl Effect for PhaseQuantisation {
    fn delay_s(&self, delay_s: f64, frequency_hz: f64) -> f64 {
        let step_s = 1.0 / (frequency_hz * f64::from(self.steps.get()));
        (delay_s / step_s).round() * step_s
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn delays_are_whole_steps_and_never_off_by_more_than_half_of_one() {
        let effect = effect::<PhaseQuantisation>("steps = 8");
        for i in 0..100 {
            let delay = f64::from(i) * 3.1e-7;
            let steps = effect.delay_s(delay, 40e3) * 40e3 * 8.0;
            assert!((steps - steps.round()).abs() < 1e-9);
            assert!((steps - delay * 40e3 * 8.0).abs() <= 0.5 + 1e-9);
        }
    }
}
