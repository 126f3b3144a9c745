//! The converter clips: its full scale is lower than in the rig file.

use serde::Deserialize;

use super::Effect;
use fieldgap_input::Positive;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Clipping {
    /// The full scale, V.
    level: Positive,
}

impl Effect for Clipping {
    fn full_scale_v(&self, full_scale_v: f64) -> f64 {
        full_scale_v.min(self.level.get())
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_full_scale_is_the_lower_of_the_two() {
        let effect = effect::<Clipping>("level = 1.5");
        assert_eq!((effect.full_scale_v(5.0), effect.full_scale_v(1.0)), (1.5, 1.0));
    }
}
