//! The carrier is off its nominal frequency. Delays keep their values in seconds: their clock is right.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveFrequency {
    /// True over nominal.
    ratio: Positive,
}

impl Effect for DriveFrequency {
    fn frequency_hz(&self, frequency_hz: f64) -> f64 {
        frequency_hz * self.ratio.get()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_carrier_scales() {
        assert_eq!(effect::<DriveFrequency>("ratio = 1.01").frequency_hz(40e3), 40e3 * 1.01);
    }
}
