//! One to three elements are wired in reverse.

use super::Search;
use super::of_elements::OfElements;

pub(super) static POLARITY: OfElements = OfElements {
    id: "polarity",
    search: Search::Sets,
    words: "wired in reverse",
    act: |elements, supposed| supposed.reversed = elements.to_vec(),
};
