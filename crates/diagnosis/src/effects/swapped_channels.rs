//! Two elements hang on each other's outputs.

use super::Search;
use super::of_elements::OfElements;

pub(super) static SWAPPED_CHANNELS: OfElements = OfElements {
    id: "swapped-channels",
    search: Search::Exchanges,
    words: "on each other's outputs",
    act: |elements, supposed| supposed.swapped = elements.try_into().ok(),
};
