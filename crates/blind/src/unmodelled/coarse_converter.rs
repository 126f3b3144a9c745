//! The receiver's converter has few bits, or its input range is set far too wide: readings have coarse steps.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "coarse-converter";

#[derive(Debug, Clone, Copy)]
struct CoarseConverter {
    step_v: f64,
}

/// At the largest size four steps cover the expected range.
pub(super) fn draw(laboratory: &Laboratory, _: &mut RandomSequence) -> Draw {
    let peak_v = laboratory.peak_v;
    Draw::new(0.25, move |size| CoarseConverter { step_v: peak_v * size })
}

impl Unmodelled for CoarseConverter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! { step_v = (self.step_v) }
    }

    fn read_v(&self, reading_v: f64) -> f64 {
        (reading_v / self.step_v).round() * self.step_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_whole_steps_and_off_by_half_of_one_at_most() {
        let converter = CoarseConverter { step_v: 0.03 };
        for n in 0..100 {
            let (level_v, read_v) = (0.007 * f64::from(n), converter.read_v(0.007 * f64::from(n)));
            assert!((read_v - level_v).abs() <= 0.015 + 1e-12);
            assert!((read_v / 0.03 - (read_v / 0.03).round()).abs() < 1e-9);
        }
    }
}
