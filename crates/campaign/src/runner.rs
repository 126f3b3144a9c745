//! Runs a campaign: rounds by their schedule, conditions, cells on several benches at once, and what follows.
//!
//! A cell is never measured twice nor lost, because its record says how far it is: a line of the log announces each step before it begins, and
//! after a kill the record decides.

mod cell;
mod conditions;
mod waiting;

pub(super) use self::cell::planned_use;
use std::cell::RefCell;
use std::path::Path;

use futures_util::future::join_all;
use jiff::Timestamp;

use super::design::{Block, Cell};
use super::error::CampaignError;
use super::file::{BaselineSource, Campaign};
use super::folder::{CampaignFolder, CellState, State, What, cell_folder};
use super::follow::{BaselineRuns, CellFigures, FollowedRun, Follower};
use super::laboratory::{Laboratory, News};
use super::overview::Overview;

/// Which cells are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// Those that are not done and have attempts left, and all rounds to come.
    Open,
    /// Those that failed, in the rounds so far.
    Failed,
    /// Those that are done and were changed in the file since, in the rounds so far.
    Changed,
}

/// How a campaign ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CampaignEnd {
    /// All cells of the selection were tried.
    Done,
    /// It ended before, for a reason; `resume` continues it.
    Early(String),
}

/// A campaign that is running.
pub struct Runner<'a> {
    campaign: &'a Campaign,
    laboratory: &'a dyn Laboratory,
    folder: RefCell<CampaignFolder>,
    follower: RefCell<Follower>,
    selection: Selection,
}

impl<'a> Runner<'a> {
    /// Prepares to run a campaign in its folder.
    ///
    /// # Errors
    /// A baseline that cannot be read.
    pub fn new(
        campaign: &'a Campaign,
        folder: CampaignFolder,
        laboratory: &'a dyn Laboratory,
        selection: Selection,
    ) -> Result<Self, CampaignError> {
        let figures_of =
            |folder: &Path, setting: &str, at| laboratory.figures_of(folder, setting, at);
        let follower = followed(campaign, folder.path(), folder.state(), &figures_of)?;
        let (folder, follower) = (RefCell::new(folder), RefCell::new(follower));
        Ok(Self { campaign, laboratory, folder, follower, selection })
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// [`CampaignError`] where the log cannot be written. Failures of cells, rigs and conditions are no errors.
    pub async fn run(self) -> Result<CampaignEnd, CampaignError> {
        let ended = self.rounds().await?;
        let reason = match &ended {
            CampaignEnd::Done => None,
            CampaignEnd::Early(reason) => Some(reason.clone()),
        };
        self.log(What::Ended { reason: reason.clone() })?;
        self.draw(None).await;
        self.laboratory.tell(News::Ended(reason.as_deref())).await;
        Ok(ended)
    }

    async fn rounds(&self) -> Result<CampaignEnd, CampaignError> {
        let begun = self.folder.borrow().state().rounds.len() as u32;
        for round in 1..=begun {
            if let Some(reason) = self.round(round).await? {
                return Ok(CampaignEnd::Early(reason));
            }
        }
        if self.selection != Selection::Open {
            return Ok(CampaignEnd::Done);
        }
        for round in begun + 1..=self.campaign.schedule.rounds {
            let left_out = match self.wait_for_round().await {
                Ok(left_out) => left_out,
                Err(reason) => return Ok(CampaignEnd::Early(reason)),
            };
            self.log(What::Round { round, left_out })?;
            self.laboratory.tell(News::Round(round)).await;
            if let Some(reason) = self.round(round).await? {
                return Ok(CampaignEnd::Early(reason));
            }
        }
        Ok(CampaignEnd::Done)
    }

    /// Runs the cells of a round that are to be measured; gives the reason where the campaign has to end.
    async fn round(&self, round: u32) -> Result<Option<String>, CampaignError> {
        let seed = self.folder.borrow().state().seed;
        for mut block in self.campaign.round(round, seed) {
            for queue in &mut block.queues {
                queue.retain(|cell| self.is_selected(cell));
            }
            if block.queues.iter().all(|queue| self.nothing_to_do(queue)) {
                continue;
            }
            if let Some(reason) = self.must_end().await {
                return Ok(Some(reason));
            }
            if !self.set_conditions(&block).await? {
                continue;
            }
            if let Some(reason) = self.benches(&block).await? {
                return Ok(Some(reason));
            }
        }
        Ok(None)
    }

    /// Runs the queues of all benches at once; gives the first reason to end.
    async fn benches(&self, block: &Block) -> Result<Option<String>, CampaignError> {
        let ended = join_all(block.queues.iter().map(|queue| self.queue(queue))).await;
        let mut first = None;
        for reason in ended {
            first = first.or(reason?);
        }
        Ok(first)
    }

    /// Runs the cells of one bench; gives the reason where the campaign has to end.
    async fn queue(&self, queue: &[Cell]) -> Result<Option<String>, CampaignError> {
        let mut failures_in_a_row = 0;
        for cell in queue {
            let rig = &self.campaign.benches[cell.bench].name;
            if self.folder.borrow().state().rigs_left.contains_key(rig) {
                return Ok(None);
            }
            if let Some(reason) = self.must_end().await {
                return Ok(Some(reason));
            }
            match self.cell(cell).await? {
                cell::Outcome::Done => failures_in_a_row = 0,
                cell::Outcome::Ends(reason) => return Ok(Some(reason)),
                cell::Outcome::Failed(reason) => {
                    failures_in_a_row += 1;
                    if failures_in_a_row >= self.campaign.retry.failures_in_a_row {
                        let reason = format!(
                            "{failures_in_a_row} cells in a row failed; the last: {reason}"
                        );
                        self.log(What::RigLeft { rig: rig.clone(), reason: reason.clone() })?;
                        self.laboratory.tell(News::RigLeft(rig, &reason)).await;
                        return Ok(None);
                    }
                }
            }
        }
        Ok(None)
    }

    /// Whether a cell belongs to what was asked for.
    fn is_selected(&self, cell: &Cell) -> bool {
        let folder = self.folder.borrow();
        let id = self.campaign.id_of(cell);
        let log = folder.state().cells.get(&id);
        match (self.selection, log.map(|log| &log.state)) {
            (Selection::Open, None | Some(CellState::Begun | CellState::Measured)) => true,
            (Selection::Open, Some(CellState::Failed { .. })) => self.attempts_left(&id) > 0,
            (Selection::Open, Some(CellState::Closed { .. })) => false,
            (Selection::Failed, state) => matches!(state, Some(CellState::Failed { .. })),
            (Selection::Changed, Some(CellState::Closed { .. })) => {
                let digest = self.campaign.digest_of(cell);
                log.zip(digest.ok()).is_some_and(|(log, digest)| log.digest != digest)
            }
            (Selection::Changed, _) => false,
        }
    }

    /// How often a cell may be tried. A process that was killed between two attempts has used those that failed; a person who asks for the cells
    /// that failed gives all of them again.
    fn attempts_left(&self, id: &str) -> u32 {
        let all = self.campaign.retry.attempts.saturating_add(1);
        let folder = self.folder.borrow();
        let failures = folder.state().cells.get(id).map_or(0, |log| log.failures);
        match self.selection {
            Selection::Open => all.saturating_sub(failures),
            Selection::Failed | Selection::Changed => all,
        }
    }

    /// Whether no cell of a queue will be measured.
    fn nothing_to_do(&self, queue: &[Cell]) -> bool {
        let folder = self.folder.borrow();
        let left = |cell: &Cell| {
            folder.state().rigs_left.contains_key(&self.campaign.benches[cell.bench].name)
        };
        queue.first().is_none_or(left)
    }

    fn log(&self, what: What) -> Result<(), CampaignError> {
        self.folder.borrow_mut().log(self.laboratory.now(), what)
    }

    /// Draws the campaign as it is, with the question that it waits for.
    async fn draw(&self, question: Option<String>) {
        let overview = {
            let folder = self.folder.borrow();
            Overview::of(self.campaign, folder.path(), folder.state(), &self.follower.borrow())
        };
        self.laboratory.draw(Overview { question, ..overview }).await;
    }
}

/// Gives the figures of the record in a folder: of the setting, at the time.
pub type FiguresOf<'a> = dyn Fn(&Path, &str, Option<Timestamp>) -> Option<CellFigures> + 'a;

/// The figures of all cells that are closed, in the order in which they were closed, on their charts.
///
/// # Errors
/// A baseline that cannot be read.
pub fn followed(
    campaign: &Campaign,
    folder: &Path,
    state: &State,
    figures_of: &FiguresOf<'_>,
) -> Result<Follower, CampaignError> {
    let baseline = match &campaign.baseline {
        BaselineSource::FirstRounds(rounds) => BaselineRuns::FirstRounds(*rounds),
        BaselineSource::Record(record) => {
            let settings: std::collections::BTreeSet<String> =
                campaign.cells(1, 0).map(|cell| campaign.setting_of(&cell)).collect();
            let runs = settings.iter().filter_map(|setting| figures_of(record, setting, None));
            BaselineRuns::Given(runs.map(|figures| figures.run).collect())
        }
        BaselineSource::Campaign(other) => {
            let before = CampaignFolder::campaign(other)?;
            let state = CampaignFolder::read(other)?;
            let runs = closed_runs(&before, other, &state, figures_of);
            BaselineRuns::Given(runs.into_iter().map(|one| one.run).collect())
        }
    };
    let mut follower = Follower::new(campaign.alarm.clone(), baseline);
    let mut acknowledged = state.acknowledged.iter().map(|(one, ..)| one).peekable();
    for run in closed_runs(campaign, folder, state, figures_of) {
        while let Some(one) = acknowledged.next_if(|one| one.at <= run.run.at) {
            follower.acknowledge(one);
        }
        follower.add(run);
    }
    acknowledged.for_each(|one| follower.acknowledge(one));
    Ok(follower)
}

/// The runs of all closed cells that are still in the file, oldest first.
fn closed_runs(
    campaign: &Campaign,
    folder: &Path,
    state: &State,
    figures_of: &FiguresOf<'_>,
) -> Vec<FollowedRun> {
    let rounds = 1..=state.rounds.len() as u32;
    let cells = rounds.flat_map(|round| campaign.cells(round, state.seed));
    let mut closed: Vec<_> = cells
        .filter_map(|cell| {
            let id = campaign.id_of(&cell);
            let log = state.cells.get(&id)?;
            matches!(log.state, CellState::Closed { .. }).then_some((
                log.at,
                log.measured,
                cell,
                id,
            ))
        })
        .collect();
    closed.sort_by_key(|(at, ..)| *at);
    closed
        .into_iter()
        .filter_map(|(_, measured, cell, id)| {
            let folder = cell_folder(folder, &id);
            let CellFigures { run, verdict } =
                figures_of(&folder, &campaign.setting_of(&cell), measured)?;
            Some(FollowedRun { round: cell.round, folder, run, verdict })
        })
        .collect()
}
