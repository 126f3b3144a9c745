//! The array misses some of its commands and sounds as at power-up, with all elements in phase.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::scattered_readings::SomeReadings;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "missed-commands";

#[derive(Debug, Clone, Copy)]
struct MissedCommands {
    when: SomeReadings,
}

/// For up to a third of the readings, in runs: the next command sets it right.
pub(super) fn draw(_: &Laboratory, random: &mut RandomSequence) -> Draw {
    let (rng, run) = (SomeReadings::drawn(random), 1 + random.index(20));
    Draw::new(0.35, move |share| MissedCommands { when: SomeReadings::new(rng, share, run) })
}

impl Unmodelled for MissedCommands {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        toml::toml! { share = (self.when.share()) }
    }

    fn is_unfocused(&self, n: usize) -> bool {
        self.when.has(n)
    }
}
