//! The level jumps at one moment of the scan: a loose plug, or an amplifier that changes its range.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};
use fieldgap_virtual_rig::effects::Effect;

pub(super) const NAME: &str = "gain-jump";

#[derive(Debug, Clone, Copy)]
struct GainJump {
    at_s: f64,
    relative: f64,
}

/// In the middle half of the scan: near an end it would change too few readings.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.25, 0.75) * laboratory.survey.lasts_s();
    let sign = random.sign();
    Draw::new(0.5, move |size| GainJump { at_s, relative: sign * size })
}

impl Effect for GainJump {
    fn level_v(&self, level_v: f64, time_s: f64) -> f64 {
        if time_s < self.at_s { level_v } else { level_v * (1.0 + self.relative) }
    }
}

impl Unmodelled for GainJump {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            at_s = (self.at_s)
            relative = (self.relative)
        }
    }

    fn effect(&self) -> Option<(&'static str, Box<dyn Effect>)> {
        Some((NAME, Box::new(*self)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_is_another_from_one_moment_on() {
        let jump = GainJump { at_s: 100.0, relative: -0.2 };
        assert_eq!(jump.level_v(1.0, 99.9), 1.0);
        assert_eq!(jump.level_v(1.0, 100.0), 0.8);
    }
}
