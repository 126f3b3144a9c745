//! Another source in the room sounds at the same frequency and from the same clock, such as a second array that was left on.

use num_complex::Complex64;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "second-source";

#[derive(Debug, Clone, Copy)]
struct SecondSource {
    at_m: Vec3,
    /// Complex amplitude at 1 m, in that of an element of the array.
    amplitude: Complex64,
}

/// Half a metre to two metres beside the array, up to twice as loud as ten of its elements.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (sin, cos) = random.angle_rad().sin_cos();
    let away_m = random.uniform(0.5, 2.0);
    let at_m = Vec3::new(away_m * cos, away_m * sin, random.uniform(-0.2, 0.5));
    let angle_rad = random.angle_rad();
    Draw::new(20.0, move |size| SecondSource {
        at_m,
        amplitude: Complex64::from_polar(size, angle_rad),
    })
}

impl Unmodelled for SecondSource {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let (at_mm, amplitude) = (self.at_m * 1e3, self.amplitude);
        toml::toml! {
            at_mm = [(at_mm.x), (at_mm.y), (at_mm.z)]
            amplitude = [(amplitude.re), (amplitude.im)]
        }
    }

    fn beside(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Complex64 {
        let distance_m = (at_m - self.at_m).norm();
        self.amplitude * Complex64::from_polar(1.0 / distance_m, wavenumber_rad_m * distance_m)
    }
}
