//! The receiver is tilted.

use super::super::laboratory::Laboratory;
use super::super::random_sequence::RandomSequence;
use super::Draw;

pub(super) const NAME: &str = "tilted-receiver";

/// Tilted by 15 to 35 degrees in a random direction. The size sets the width of its lobe.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (tilt_rad, azimuth_rad) = (random.uniform(15.0, 35.0).to_radians(), random.angle_rad());
    let (x, y) = (tilt_rad.sin() * azimuth_rad.cos(), tilt_rad.sin() * azimuth_rad.sin());
    let z = tilt_rad.cos();
    Draw::of_truth(NAME, 1.0, move |size| {
        // The loss in dB is inversely proportional to the square of the lobe's width.
        let half_angle_deg = 25.0 / size.sqrt();
        toml::toml! {
            axis = [(x), (y), (z)]
            half_angle_deg = (half_angle_deg)
        }
    })
}
