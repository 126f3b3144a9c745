//! The searches of a loop. What the last one left in question is kept, so that the readings of the next round need no search of their own.

use std::sync::{Mutex, PoisonError};

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Incomparable;
use fieldgap_diagnosis::{EffectId, Findings, LiveSets, Options};
use fieldgap_records::RecordedScan;

/// Effects that a loop does not look for: every place of a wall or an object would be tried after each round.
const SOUGHT_LONG: [EffectId; 2] = [EffectId::Wall, EffectId::Scatterer];

/// The searches of one record.
pub(crate) struct Searches {
    options: Options,
    /// The sets that the last search left in question, and how many readings it had.
    last: Mutex<Option<(usize, LiveSets)>>,
}

impl Searches {
    /// For the gap of a simulator.
    pub fn of(simulator: Simulator) -> Self {
        let effects = EffectId::ALL.iter().copied();
        let effects = effects.filter(|effect| !SOUGHT_LONG.contains(effect)).collect();
        let options = Options {
            simulator: Some(simulator),
            effects: Some(effects),
            few_causes: true,
            ..Options::default()
        };
        Self { options, last: Mutex::default() }
    }

    /// A search of these readings among all sets.
    ///
    /// # Errors
    /// [`Incomparable`] if there is nothing to compare.
    pub fn among_all<'r>(
        &self,
        scans: &'r [RecordedScan; 1],
    ) -> Result<Findings<'r>, Incomparable> {
        let findings = Findings::of(scans, &self.options)?;
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        *last = Some((scans[0].samples.len(), findings.live_sets()));
        Ok(findings)
    }

    /// The sets that a search of the first readings leaves in question, fitted to all readings.
    ///
    /// # Errors
    /// [`Incomparable`] if there is nothing to compare.
    pub fn among_live<'r>(
        &self,
        scans: &'r [RecordedScan; 1],
        first: usize,
    ) -> Result<Findings<'r>, Incomparable> {
        let live = self.live_sets(&[up_to(&scans[0], first)])?;
        Findings::of_live(scans, &self.options, &live)
    }

    /// The sets that a search of these readings leaves in question; the search is made if it is not the last one.
    ///
    /// # Errors
    /// [`Incomparable`] if there is nothing to compare.
    pub fn live_sets(&self, scans: &[RecordedScan; 1]) -> Result<LiveSets, Incomparable> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner).clone();
        match last {
            Some((readings, live)) if readings == scans[0].samples.len() => Ok(live),
            _ => Ok(self.among_all(scans)?.live_sets()),
        }
    }
}

/// The first readings of a record.
pub(crate) fn up_to(record: &RecordedScan, readings: usize) -> RecordedScan {
    let samples = record.samples[..readings.min(record.samples.len())].to_vec();
    RecordedScan { setup: record.setup.clone(), samples }
}
