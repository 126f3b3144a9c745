//! The mains modulates the level: an amplifier's supply hums, and readings taken at their own pace show the beat.

use std::f64::consts::TAU;

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::super::survey::Stop;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "mains-hum";

#[derive(Debug, Clone, Copy)]
struct MainsHum {
    /// Frequency of the ripple: twice that of the mains, a little off.
    hz: f64,
    phase_rad: f64,
    depth: f64,
}

/// Up to 40 % of the level, at 100 Hz or 120 Hz, which mains keep to a tenth of a percent.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let nominal_hz = if random.chance(0.5) { 100.0 } else { 120.0 };
    let hz = nominal_hz * random.uniform(0.999, 1.001);
    let phase_rad = random.angle_rad();
    Draw::new(0.4, move |depth| MainsHum { hz, phase_rad, depth })
}

impl Unmodelled for MainsHum {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let Self { hz, phase_rad, depth } = self;
        toml::toml! {
            hz = (*hz)
            phase_rad = (*phase_rad)
            depth = (*depth)
        }
    }

    fn gain(&self, stop: &Stop) -> f64 {
        1.0 + self.depth * (TAU * self.hz * stop.time_s + self.phase_rad).sin()
    }
}
