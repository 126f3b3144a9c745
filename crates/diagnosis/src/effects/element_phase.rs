//! Phases differ from element to element.

use super::random::Random;

pub(super) static ELEMENT_PHASE: Random = Random {
    id: "element-phase",
    spread: "spread_rad",
    departures: "departures_rad",
    words: |spread, error| {
        format!("phases differ from element to element by {spread:.3} ± {error:.3} rad")
    },
    act: |departures, supposed| {
        supposed.extra_phases_rad = departures.to_vec();
    },
};
