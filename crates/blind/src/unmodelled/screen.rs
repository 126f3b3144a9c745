//! An obstacle on one side, whose edge diffracts the sound.

use super::super::laboratory::{FREQUENCY_HZ, Laboratory};
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "screen";

/// Below the lowest plane, with its edge 5 to 25 mm from the axis on a random side.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let height_mm = random.uniform(15.0, 40.0);
    let (y, x) = random.angle_rad().sin_cos();
    let edge_mm = random.uniform(-25.0, -5.0);
    Draw::of_truth(NAME, 1.0, move |opacity| {
        toml::toml! {
            height_mm = (height_mm)
            open = [(x), (y)]
            edge_mm = (edge_mm)
            opacity = (opacity)
            frequency_hz = (FREQUENCY_HZ)
        }
    })
}
