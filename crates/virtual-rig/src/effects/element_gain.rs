//! Amplitudes differ from element to element: 1 + spread times a standard normal number, not below 0.

use serde::Deserialize;

use super::{Effect, TrueArray};
use crate::counter_rng::CounterRng;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ElementGain {
    /// Relative standard deviation.
    spread: NonNegative,
}

impl Effect for ElementGain {
    fn array(&self, array: &mut TrueArray, rng: CounterRng) {
        for (n, element) in array.elements.iter_mut().enumerate() {
            element.amplitude *= (1.0 + self.spread.get() * rng.normal(n as u64)).max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn amplitudes_spread_by_the_given_deviation() {
        let mut array = TrueArray::of_many(4000);
        effect::<ElementGain>("spread = 0.2").array(&mut array, CounterRng::new(1));
        let n = array.elements.len() as f64;
        let mean = array.elements.iter().map(|e| e.amplitude).sum::<f64>() / n;
        let variance = array.elements.iter().map(|e| (e.amplitude - mean).powi(2)).sum::<f64>() / n;
        assert!((mean - 1.0).abs() < 0.02 && (variance.sqrt() - 0.2).abs() < 0.01);
    }
}
