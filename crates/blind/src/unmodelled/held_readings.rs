//! The receiver sometimes gives its last reading again: it was asked before the next one was ready.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::scattered_readings::SomeReadings;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "held-readings";

#[derive(Debug, Clone, Copy)]
struct HeldReadings {
    when: SomeReadings,
}

/// Up to nine readings in ten.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let rng = SomeReadings::drawn(random);
    Draw::new(0.9, move |share| HeldReadings { when: SomeReadings::new(rng, share, 1) })
}

impl Unmodelled for HeldReadings {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! { share = (self.when.share()) }
    }

    fn reads_stop(&self, n: usize) -> usize {
        (0..=n).rev().find(|&stop| stop == 0 || !self.when.has(stop)).unwrap_or(n)
    }
}
