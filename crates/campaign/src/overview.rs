//! All that a page or a table shows of a campaign.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use serde::Serialize;

use super::budget::Use;
use super::design::Cell;
use super::file::Campaign;
use super::folder::{CellState, LoggedAlarm, State, cell_folder};
use super::follow::Follower;
use fieldgap_monitoring::{Alarm, ChartPoint, Run};

/// What a campaign is like at a moment.
#[derive(Debug, Clone, Serialize)]
pub struct Overview {
    /// Its name.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// When it began.
    pub began: Option<Timestamp>,
    /// Rounds in all.
    pub rounds: u32,
    /// When each round began.
    pub rounds_begun: Vec<Timestamp>,
    /// Starts that passed while a round was going on, and were left out.
    pub starts_left_out: u32,
    /// Name and values of each dimension: rigs if there are several, conditions, axes.
    pub dimensions: Vec<Dimension>,
    /// The cells of all rounds that began, and of the first.
    pub cells: Vec<CellOverview>,
    /// Alarms, oldest first.
    pub alarms: Vec<AlarmOverview>,
    /// The points of each figure's charts, in the order of the runs. Not in JSON.
    #[serde(skip)]
    pub charts: BTreeMap<String, Vec<ChartPoint>>,
    /// Why there are no charts; `None` where there are.
    pub why_no_charts: Option<String>,
    /// Rigs that are left alone, and why.
    pub rigs_left: BTreeMap<String, String>,
    /// Conditions that could not be set since the last resume, with reasons.
    pub not_set: Vec<String>,
    /// The question to a person whose answer it waits for.
    pub question: Option<String>,
    /// What was used. Its time is that of the scans.
    pub used: Use,
    /// Whether no process works on it any more, as far as its log says.
    pub ended: bool,
    /// Why the last process ended, if it ended early.
    pub ended_early: Option<String>,
}

/// A dimension of a campaign.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Dimension {
    /// Its name.
    pub name: String,
    /// The labels of its values.
    pub values: Vec<String>,
}

/// How far a cell is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "status")]
pub enum CellStatus {
    /// It did not begin.
    Open,
    /// Its scan began.
    Scanning,
    /// It is measured, and not compared.
    Measured,
    /// It is done.
    Done {
        /// What could not be done after the scan.
        problem: Option<String>,
        /// Whether plan, rig file or campaign file changed since, so that the cell would be another one now.
        changed: bool,
    },
    /// It failed.
    Failed {
        /// Why.
        reason: String,
    },
}

/// A cell.
#[derive(Debug, Clone, Serialize)]
pub struct CellOverview {
    /// The name of its folder below `cells`.
    pub id: String,
    /// Its round, from 1.
    pub round: u32,
    /// Its repeat in the round, from 1.
    pub repeat: u32,
    /// Its setting, the same in every round.
    pub setting: String,
    /// The number of its value in each of [`Overview::dimensions`].
    pub values: Vec<usize>,
    /// How far it is.
    #[serde(flatten)]
    pub status: CellStatus,
    /// Its figures, if it was compared.
    pub run: Option<Run>,
    /// The verdict of its diagnosis, if it was diagnosed.
    pub verdict: Option<String>,
    /// Change of the gap against the baseline, relative.
    pub gap_change: Option<f64>,
    /// Whether it raised an alarm that nobody acknowledged.
    pub alarm: bool,
}

/// An alarm.
#[derive(Debug, Clone, Serialize)]
pub struct AlarmOverview {
    /// The cell's folder below `cells`.
    pub cell: String,
    /// The alarm.
    pub alarm: Alarm,
    /// The alarm in a sentence.
    pub sentence: String,
    /// What a comparison of the records before and after says.
    pub cause: Option<String>,
    /// Whether nobody acknowledged it.
    pub open: bool,
}

impl Overview {
    /// The overview of a campaign in its folder, without an open question.
    pub fn of(campaign: &Campaign, folder: &Path, state: &State, follower: &Follower) -> Self {
        let open: Vec<&LoggedAlarm> = state.open_alarms().collect();
        let runs: BTreeMap<&Path, _> =
            follower.runs().iter().map(|one| (one.folder.as_path(), one)).collect();
        let rounds = 1..=(state.rounds.len() as u32).max(1);
        let cells = rounds.flat_map(|round| campaign.cells(round, state.seed)).map(|cell| {
            let id = campaign.id_of(&cell);
            let followed = runs.get(cell_folder(folder, &id).as_path());
            CellOverview {
                round: cell.round,
                repeat: cell.repeat,
                setting: campaign.setting_of(&cell),
                values: campaign.places_of(&cell),
                status: status(campaign, state, &cell, &id),
                run: followed.map(|one| one.run.clone()),
                verdict: followed.and_then(|one| one.verdict.clone()),
                gap_change: followed.and_then(|one| follower.gap_change(&one.run)),
                alarm: open.iter().any(|logged| logged.cell == id),
                id,
            }
        });
        let mut cells: Vec<CellOverview> = cells.collect();
        cells.sort_by(|one, other| {
            let key = |cell: &CellOverview| (cell.round, cell.values.clone(), cell.repeat);
            key(one).cmp(&key(other))
        });
        Self {
            name: campaign.name.clone(),
            folder: folder.to_owned(),
            began: state.began,
            rounds: campaign.schedule.rounds,
            rounds_begun: state.rounds.clone(),
            starts_left_out: state.left_out,
            dimensions: campaign.dimensions(),
            cells,
            alarms: state
                .alarms
                .iter()
                .map(|logged| AlarmOverview {
                    cell: logged.cell.clone(),
                    sentence: logged.alarm.to_string(),
                    alarm: logged.alarm.clone(),
                    cause: logged.cause.clone(),
                    open: open.iter().any(|one| std::ptr::eq(*one, logged)),
                })
                .collect(),
            charts: follower.charts().clone(),
            why_no_charts: follower.why_no_charts().map(str::to_owned),
            rigs_left: state.rigs_left.clone(),
            not_set: state.not_set.iter().cloned().collect(),
            question: None,
            used: state.used,
            ended: state.ended.is_some(),
            ended_early: state.ended.clone().flatten(),
        }
    }

    /// How many cells are done, failed, and neither, of the rounds that began.
    pub fn counts(&self) -> [usize; 3] {
        let count =
            |of: fn(&CellStatus) -> bool| self.cells.iter().filter(|cell| of(&cell.status)).count();
        let done = count(|status| matches!(status, CellStatus::Done { .. }));
        let failed = count(|status| matches!(status, CellStatus::Failed { .. }));
        [done, failed, self.cells.len() - done - failed]
    }
}

fn status(campaign: &Campaign, state: &State, cell: &Cell, id: &str) -> CellStatus {
    let Some(log) = state.cells.get(id) else { return CellStatus::Open };
    match &log.state {
        CellState::Begun => CellStatus::Scanning,
        CellState::Measured => CellStatus::Measured,
        CellState::Failed { reason } => CellStatus::Failed { reason: reason.clone() },
        CellState::Closed { problem } => {
            let changed = campaign.digest_of(cell).is_ok_and(|digest| digest != log.digest);
            CellStatus::Done { problem: problem.clone(), changed }
        }
    }
}

impl Campaign {
    /// The dimensions: rigs if there are several, conditions, axes.
    pub fn dimensions(&self) -> Vec<Dimension> {
        let several = self.benches.len() > 1;
        let rigs = several.then(|| Dimension {
            name: "rig".to_owned(),
            values: self.benches.iter().map(|bench| bench.name.clone()).collect(),
        });
        let conditions = self.conditions.iter().map(|condition| Dimension {
            name: condition.name.clone(),
            values: condition.values.iter().map(|value| value.label.clone()).collect(),
        });
        let axes = self.axes.iter().map(|axis| Dimension {
            name: axis.name.clone(),
            values: axis.sweep.values.iter().map(|value| value.label.clone()).collect(),
        });
        rigs.into_iter().chain(conditions).chain(axes).collect()
    }

    /// The number of a cell's value in each dimension.
    fn places_of(&self, cell: &Cell) -> Vec<usize> {
        let rig = (self.benches.len() > 1).then_some(cell.bench);
        rig.into_iter()
            .chain(cell.conditions.iter().copied())
            .chain(cell.axes.iter().copied())
            .collect()
    }
}
