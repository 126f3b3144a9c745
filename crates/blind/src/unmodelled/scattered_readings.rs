//! Which readings a cause befalls that befalls some of them, alone or in runs.

use fieldgap_virtual_rig::counter_rng::CounterRng;

use super::super::random_sequence::RandomSequence;

/// A share of the readings, in runs of a length.
#[derive(Debug, Clone, Copy)]
pub(super) struct SomeReadings {
    rng: CounterRng,
    share: f64,
    run: usize,
}

impl SomeReadings {
    /// A share, 0 to 1, in runs of `run` readings.
    pub fn new(rng: CounterRng, share: f64, run: usize) -> Self {
        Self { rng, share, run: run.max(1) }
    }

    /// Random numbers for the choice.
    pub fn drawn(random: &mut RandomSequence) -> CounterRng {
        CounterRng::new(random.index(1 << 40) as u64)
    }

    /// Whether the `n`th reading is one of them.
    pub fn has(self, n: usize) -> bool {
        self.rng.uniform((n / self.run) as u64) < self.share
    }

    /// The share.
    pub fn share(self) -> f64 {
        self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_have_their_share_and_come_in_runs() {
        let some = SomeReadings::new(CounterRng::new(4), 0.2, 5);
        let befallen: Vec<bool> = (0..20_000).map(|n| some.has(n)).collect();
        let count = befallen.iter().filter(|&&is| is).count();
        assert!((count as f64 / 4000.0 - 1.0).abs() < 0.1, "{count}");
        assert!(befallen.chunks(5).all(|run| run.iter().all(|&is| is == run[0])));
    }
}
