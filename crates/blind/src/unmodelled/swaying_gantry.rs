//! The gantry sways: the receiver swings about where it should be, with a period of its own.

use std::f64::consts::TAU;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::super::survey::Stop;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "swaying-gantry";

#[derive(Debug, Clone, Copy)]
struct SwayingGantry {
    swing_mm: Vec3,
    period_s: f64,
    phase_rad: f64,
}

/// Frames of profiles sway with some hertz; slower ones stand on rubber or hang. Horizontally, by up to 3 mm.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (sin, cos) = random.angle_rad().sin_cos();
    let period_s = random.log_uniform(0.3, 20.0);
    let phase_rad = random.angle_rad();
    Draw::new(3.0, move |size| SwayingGantry {
        swing_mm: Vec3::new(cos, sin, 0.0) * size,
        period_s,
        phase_rad,
    })
}

impl Unmodelled for SwayingGantry {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let Self { swing_mm, period_s, phase_rad } = self;
        toml::toml! {
            swing_mm = [(swing_mm.x), (swing_mm.y)]
            period_s = (*period_s)
            phase_rad = (*phase_rad)
        }
    }

    fn displacement_mm(&self, stop: &Stop) -> Vec3 {
        (TAU * stop.time_s / self.period_s + self.phase_rad).sin() * self.swing_mm
    }
}
