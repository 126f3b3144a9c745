//! The array's board is bowed.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "bowed-array";

/// On a board of 60 mm a sag beyond 2 mm would be visible.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let sign = random.sign();
    Draw::of_truth(NAME, 2.0, move |rim_mm| toml::toml! { rim_mm = (sign * rim_mm) })
}
