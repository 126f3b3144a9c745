//! The room grows warmer or colder between two planes, while the robot waited: a door, an air conditioner.

use super::super::causes::Parameters;
use super::super::dice::Dice;
use super::super::laboratory::{Laboratory, SPEED_M_S};
use super::{Draw, Outside};

pub(super) const NAME: &str = "temperature-step";

#[derive(Debug, Clone, Copy)]
struct TemperatureStep {
    at_s: f64,
    /// Change of the sound speed, relative.
    relative: f64,
}

/// Up to 3 % of the sound speed, which is 18 °C.
pub(super) fn draw(laboratory: &Laboratory, dice: &mut Dice) -> Draw {
    let begun = laboratory.survey.planes_begin_s();
    // Before the last plane of the first focus at the latest, so that something is measured on either side.
    let (at_s, _) = begun[1 + dice.index(begun.len() - 1)];
    let sign = dice.sign();
    Draw::new(0.03, move |size| TemperatureStep { at_s, relative: sign * size })
}

impl Outside for TemperatureStep {
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
        let c_m_s = SPEED_M_S * (1.0 + self.relative);
        vec![(self.at_s, vec![("sound-speed", toml::toml! { c_m_s = (c_m_s) })])]
    }
}
