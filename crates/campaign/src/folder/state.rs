//! The state of a campaign: what its log says.

use std::collections::{BTreeMap, BTreeSet};

use jiff::Timestamp;

use super::entry::{Entry, What};
use crate::budget::Use;
use fieldgap_monitoring::{Acknowledgement, Alarm};

/// How far a cell is.
#[derive(Debug, Clone, PartialEq)]
pub enum CellState {
    /// Its scan began and is not complete.
    Begun,
    /// Its scan is complete; what follows is not.
    Measured,
    /// It is done.
    Closed {
        /// What could not be done after the scan, if anything.
        problem: Option<String>,
    },
    /// It failed.
    Failed {
        /// Why.
        reason: String,
    },
}

/// A cell that began.
#[derive(Debug, Clone, PartialEq)]
pub struct CellLog {
    /// How far it is.
    pub state: CellState,
    /// Digest of its plan and rig file.
    pub digest: String,
    /// When its state changed last.
    pub at: Timestamp,
    /// When its scan was complete.
    pub measured: Option<Timestamp>,
    /// Failures since it began.
    pub failures: u32,
}

/// An alarm as it was logged.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedAlarm {
    /// The cell's folder.
    pub cell: String,
    /// The alarm.
    pub alarm: Alarm,
    /// What a comparison of the records before and after says, if anything.
    pub cause: Option<String>,
}

/// The state of a campaign.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    /// When it began; `None` if it did not.
    pub began: Option<Timestamp>,
    /// Seed of the order.
    pub seed: u64,
    /// When each round began; its last is going on or done.
    pub rounds: Vec<Timestamp>,
    /// Starts that were left out.
    pub left_out: u32,
    /// The cells that began, by their folders.
    pub cells: BTreeMap<String, CellLog>,
    /// What was used.
    pub used: Use,
    /// Alarms, oldest first.
    pub alarms: Vec<LoggedAlarm>,
    /// Acknowledgements, oldest first, with who and what.
    pub acknowledged: Vec<(Acknowledgement, String, String)>,
    /// Rigs that are left alone, and why.
    pub rigs_left: BTreeMap<String, String>,
    /// Conditions that could not be set since the last resume.
    pub not_set: BTreeSet<String>,
    /// Whether a process ended by itself, and why if not because all was done; `None` while one runs or after a kill.
    pub ended: Option<Option<String>>,
    /// The last line.
    pub last: Option<Timestamp>,
}

impl State {
    /// Takes the next line of the log.
    pub fn take(&mut self, entry: &Entry) {
        let at = entry.at;
        self.last = Some(at);
        match &entry.what {
            What::Began { seed, .. } => {
                self.began = Some(at);
                self.seed = *seed;
            }
            What::Resumed => {
                self.rigs_left.clear();
                self.not_set.clear();
                self.ended = None;
            }
            What::Round { left_out, .. } => {
                self.rounds.push(at);
                self.left_out += left_out;
            }
            What::Set { .. } => {}
            What::NotSet { condition, value, reason } => {
                self.not_set.insert(format!("{condition} = {value}: {reason}"));
            }
            What::Begun { cell, digest } => {
                let failures = self.cells.get(cell).map_or(0, |log| log.failures);
                let log = CellLog {
                    state: CellState::Begun,
                    digest: digest.clone(),
                    at,
                    measured: None,
                    failures,
                };
                self.cells.insert(cell.clone(), log);
            }
            What::Measured { cell, used } => {
                self.used = self.used + *used;
                self.to(cell, CellState::Measured, at);
                if let Some(log) = self.cells.get_mut(cell) {
                    log.measured = Some(at);
                }
            }
            What::Closed { cell, problem } => {
                self.to(cell, CellState::Closed { problem: problem.clone() }, at);
            }
            What::Failed { cell, reason } => {
                self.to(cell, CellState::Failed { reason: reason.clone() }, at);
                if let Some(log) = self.cells.get_mut(cell) {
                    log.failures += 1;
                }
            }
            What::MovedAside { cell, .. } => drop(self.cells.remove(cell)),
            What::Alarm { cell, alarm, cause } => {
                let (cell, alarm, cause) = (cell.clone(), alarm.clone(), cause.clone());
                self.alarms.push(LoggedAlarm { cell, alarm, cause });
            }
            What::Acknowledged { of, who, text } => {
                self.acknowledged.push((of.clone(), who.clone(), text.clone()));
            }
            What::RigLeft { rig, reason } => {
                self.rigs_left.insert(rig.clone(), reason.clone());
            }
            What::Ended { reason } => self.ended = Some(reason.clone()),
        }
    }

    fn to(&mut self, cell: &str, state: CellState, at: Timestamp) {
        if let Some(log) = self.cells.get_mut(cell) {
            log.state = state;
            log.at = at;
        }
    }

    /// Alarms that nobody acknowledged.
    pub fn open_alarms(&self) -> impl Iterator<Item = &LoggedAlarm> {
        self.alarms.iter().filter(|logged| {
            !self.acknowledged.iter().any(|(one, ..)| {
                one.at >= logged.alarm.at
                    && one.figure.as_ref().is_none_or(|figure| *figure == logged.alarm.figure)
                    && one.cell.as_ref().is_none_or(|cell| logged.alarm.cells.contains(cell))
            })
        })
    }
}
