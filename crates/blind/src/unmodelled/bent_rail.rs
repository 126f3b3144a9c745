//! The rail along which the receiver goes is bent: its height changes with the square of the distance from the rail's middle.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::super::survey::Stop;
use super::{Draw, Unmodelled};
use fieldgap_acoustics::Vec3;

pub(super) const NAME: &str = "bent-rail";

#[derive(Debug, Clone, Copy)]
struct BentRail {
    /// 0 along x, 1 along y.
    axis: usize,
    /// Coordinate of the rail's middle, mm.
    middle_mm: f64,
    /// Half of the scan's width, mm.
    half_mm: f64,
    /// Height at the scan's edge over that in the middle, mm.
    rise_mm: f64,
}

/// By up to 6 mm over the wider side of the scan.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (low, high) = laboratory.survey.corners_mm();
    let axis = usize::from(high.y - low.y > high.x - low.x);
    let half_mm = (0.5 * (high[axis] - low[axis])).max(1.0);
    let middle_mm = 0.5 * (high[axis] + low[axis]);
    let sign = random.sign();
    Draw::new(6.0, move |size| BentRail { axis, middle_mm, half_mm, rise_mm: sign * size })
}

impl Unmodelled for BentRail {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let axis = ["x", "y"][self.axis];
        let Self { middle_mm, half_mm, rise_mm, .. } = self;
        toml::toml! {
            axis = (axis)
            middle_mm = (*middle_mm)
            half_mm = (*half_mm)
            rise_mm = (*rise_mm)
        }
    }

    fn displacement_mm(&self, stop: &Stop) -> Vec3 {
        let share = (stop.at_mm[self.axis] - self.middle_mm) / self.half_mm;
        Vec3::z() * self.rise_mm * share * share
    }
}
