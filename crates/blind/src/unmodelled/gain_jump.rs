//! The level jumps at one moment of the scan.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "gain-jump";

/// In the middle half of the scan: near an end it would change too few readings.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.25, 0.75) * laboratory.survey.lasts_s();
    let sign = random.sign();
    Draw::of_truth(NAME, 0.5, move |size| {
        toml::toml! {
            at_s = (at_s)
            relative = (sign * size)
        }
    })
}
