//! The motor of an axis loses steps at one moment: from then on the robot is beside where it reports to be.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::super::survey::Stop;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "lost-steps";

#[derive(Debug, Clone, Copy)]
struct LostSteps {
    at_s: f64,
    jump_mm: Vec3,
}

/// In the middle half of the scan, by up to 6 mm along one axis.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.25, 0.75) * laboratory.survey.lasts_s();
    let (axis, sign) = (random.index(3), random.sign());
    Draw::new(6.0, move |size| LostSteps { at_s, jump_mm: Vec3::ith(axis, sign * size) })
}

impl Unmodelled for LostSteps {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let Self { at_s, jump_mm } = self;
        toml::toml! {
            at_s = (*at_s)
            jump_mm = [(jump_mm.x), (jump_mm.y), (jump_mm.z)]
        }
    }

    fn displacement_mm(&self, stop: &Stop) -> Vec3 {
        if stop.time_s < self.at_s { Vec3::zeros() } else { self.jump_mm }
    }
}
