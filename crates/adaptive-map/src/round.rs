//! What was decided for a map, round by round: `map-rounds.jsonl` in the folder of the record.

use serde::{Deserialize, Serialize};

use fieldgap_closed_loop::{LoggedRound, UsedUp};
use fieldgap_diagnosis::EffectId;

use crate::checks::Checks;

/// Why the rounds of a map ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapEnd {
    /// The stated error is met everywhere.
    Met,
    /// A further round would lower the errors by so little that the rest of the readings would not meet the stated error.
    NoGain,
    /// The readings of the plan are used up.
    Readings,
    /// The time of the plan is used up.
    Time,
    /// The time with the array driven is used up.
    Sounding,
}

/// One decision: how certain the map was, and what is measured next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapRound {
    /// Its number, from 0.
    pub round: usize,
    /// Readings before it.
    pub before: usize,
    /// Readings that it takes.
    pub readings: usize,
    /// Of all places taken so far, those that were spread evenly.
    pub spread: usize,
    /// Whether the whole catalogue was searched, or the effects of the last search were fitted again.
    pub searched: bool,
    /// Effects that the simulation was corrected by.
    pub effects: Vec<EffectId>,
    /// Root mean square of the standard errors of the map, as a share of its peak; `None` before the first round.
    pub rms_error: Option<f64>,
    /// The largest standard error, as a share of the peak.
    pub largest_error: Option<f64>,
    /// How the readings of the round before turned out, against what was foretold.
    pub checks: Option<LoggedChecks>,
    /// What is foretold of the readings of this round: mean, standard error of the mean and noise, in the unit of the readings. Empty before
    /// anything was measured. Readings with the array silent have none.
    pub foretold: Vec<[f64; 3]>,
    /// Time that its readings are expected to take, s.
    pub expected_s: f64,
    /// Why the rounds ended; `None` while they go on.
    pub end: Option<MapEnd>,
    /// The decision in a sentence.
    pub reason: String,
}

/// [`Checks`], as logged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoggedChecks {
    /// Readings.
    pub readings: usize,
    /// Root mean square of their departures in their stated standard deviations.
    pub rms: f64,
    /// The factor on the map's standard errors that they call for.
    pub factor: f64,
}

impl From<Checks> for LoggedChecks {
    fn from(Checks { readings, rms, factor }: Checks) -> Self {
        Self { readings, rms, factor }
    }
}

impl From<LoggedChecks> for Checks {
    fn from(LoggedChecks { readings, rms, factor }: LoggedChecks) -> Self {
        Self { readings, rms, factor }
    }
}

impl LoggedRound for MapRound {
    const FILE: &'static str = "map-rounds.jsonl";

    fn number(&self) -> usize {
        self.round
    }

    fn before(&self) -> usize {
        self.before
    }

    fn forget_readings(&mut self) {
        self.readings = 0;
    }
}

impl From<UsedUp> for MapEnd {
    fn from(used_up: UsedUp) -> Self {
        match used_up {
            UsedUp::Readings => Self::Readings,
            UsedUp::Time => Self::Time,
            UsedUp::Sounding => Self::Sounding,
        }
    }
}
