//! A plume of warm air in the field.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "hot-plume";

/// Up to 8 % of the sound speed, which is some 45 °C: the air above a soldering iron.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (x, y) = (random.uniform(-20.0, 20.0), random.uniform(-20.0, 20.0));
    let z = random.uniform(20.0, 90.0);
    let radius_mm = random.uniform(10.0, 20.0);
    Draw::of_truth(NAME, 0.08, move |excess| {
        toml::toml! {
            centre_mm = [(x), (y), (z)]
            radius_mm = (radius_mm)
            excess = (excess)
        }
    })
}
