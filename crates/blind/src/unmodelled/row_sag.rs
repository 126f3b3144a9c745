//! The driver's supply voltage drops along a rail.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "row-sag";

/// Along x or along y, fed from either end.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let sign = random.sign();
    let [x, y] = if random.chance(0.5) { [sign, 0.0] } else { [0.0, sign] };
    Draw::of_truth(NAME, 0.9, move |loss| {
        toml::toml! {
            along = [(x), (y)]
            loss = (loss)
        }
    })
}
