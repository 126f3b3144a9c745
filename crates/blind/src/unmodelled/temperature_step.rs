//! The room becomes warmer or colder at one moment: a door is opened, or an air conditioner starts.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "temperature-step";

#[derive(Debug, Clone, Copy)]
struct TemperatureStep {
    at_s: f64,
    /// Sound speed until then.
    before_m_s: f64,
    /// Change of the sound speed, relative.
    relative: f64,
}

/// Up to 3 % of the sound speed, which is 18 °C.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let begun = laboratory.survey.planes_begin_s();
    let at_s = match begun.len() {
        // Between two planes: a part of the scan lies on either side.
        2.. => begun[1 + random.index(begun.len() - 1)],
        _ => random.uniform(0.25, 0.75) * laboratory.survey.lasts_s(),
    };
    let before_m_s = laboratory.true_speed_m_s();
    let sign = random.sign();
    Draw::new(0.03, move |size| TemperatureStep { at_s, before_m_s, relative: sign * size })
}

impl Unmodelled for TemperatureStep {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! {
            at_s = (self.at_s)
            relative = (self.relative)
        }
    }

    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        let c_m_s = self.before_m_s * (1.0 + self.relative);
        vec![(self.at_s, vec![("sound-speed", toml::toml! { c_m_s = (c_m_s) })])]
    }
}
