//! Amplitudes differ from element to element.

use super::random::Random;

pub(super) static ELEMENT_GAIN: Random = Random {
    id: "element-gain",
    spread: "spread",
    departures: "departures",
    words: |spread, error| {
        format!(
            "amplitudes differ from element to element by {:.1} ± {:.1} %",
            100.0 * spread,
            100.0 * error
        )
    },
    act: |departures, supposed| {
        supposed.gains = departures.iter().map(|departure| 1.0 + departure).collect();
    },
};
