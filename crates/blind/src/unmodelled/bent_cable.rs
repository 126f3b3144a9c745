//! The receiver's cable bends as the robot rises, and its gain with it.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::super::survey::Stop;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "bent-cable";

#[derive(Debug, Clone, Copy)]
struct BentCable {
    /// Where the cable begins to bend.
    from: [f64; 2],
    axis: usize,
    /// Loss at the far end of the scan.
    loss: f64,
}

/// Beyond the middle of the scan along its longest side, with the square of the way, by up to two thirds.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (low, high) = laboratory.survey.corners_mm();
    let axis = (high - low).imax();
    let share = random.uniform(0.2, 0.7);
    let from = [low[axis] + share * (high[axis] - low[axis]), high[axis]];
    Draw::new(0.66, move |loss| BentCable { from, axis, loss })
}

impl Unmodelled for BentCable {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let axis = ["x", "y", "z"][self.axis];
        let [from_mm, to_mm] = self.from;
        toml::toml! {
            axis = (axis)
            from_mm = (from_mm)
            to_mm = (to_mm)
            loss = (self.loss)
        }
    }

    fn gain(&self, stop: &Stop) -> f64 {
        let [from_mm, to_mm] = self.from;
        let share = (stop.at_mm[self.axis] - from_mm) / (to_mm - from_mm).max(1e-6);
        1.0 - self.loss * share.clamp(0.0, 1.0).powi(2)
    }
}
