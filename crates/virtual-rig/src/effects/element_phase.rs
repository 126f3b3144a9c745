//! Phases differ from element to element, normally distributed.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ElementPhase {
    /// Standard deviation, rad.
    spread_rad: NonNegative,
}

impl Effect for ElementPhase {
    fn array(&self, array: &mut TrueArray, rng: CounterRng) {
        for (n, element) in array.elements.iter_mut().enumerate() {
            element.phase_rad += self.spread_rad.get() * rng.normal(n as u64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn phases_spread_by_the_given_deviation() {
        let mut array = TrueArray::of_many(4000);
        effect::<ElementPhase>("spread_rad = 0.5").array(&mut array, CounterRng::new(1));
        let n = array.elements.len() as f64;
        let variance = array.elements.iter().map(|e| e.phase_rad.powi(2)).sum::<f64>() / n;
        assert!((variance.sqrt() - 0.5).abs() < 0.02);
    }
}
