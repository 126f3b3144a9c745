//! One to three elements are silent.

use super::Search;
use super::of_elements::OfElements;

pub(super) static DEAD_ELEMENTS: OfElements = OfElements {
    id: "dead-elements",
    search: Search::Sets,
    words: "silent",
    act: |elements, supposed| supposed.dead = elements.to_vec(),
};
