//! One cell: its scan, what follows it, and another attempt where it failed.

use jiff::SignedDuration;

use super::Runner;
use crate::budget::Use;
use crate::design::Cell;
use crate::error::CampaignError;
use crate::folder::{CellState, What};
use crate::follow::{CellFigures, FollowedRun};
use crate::laboratory::{Measured, News};
use fieldgap_acquisition::PlannedScan;
use fieldgap_records::{Journal, JournalError};

/// What became of a cell.
pub(super) enum Outcome {
    Done,
    Failed(String),
    /// The campaign has to end.
    Ends(String),
}

impl Runner<'_> {
    /// Measures a cell to its end, with the attempts that are left.
    pub(super) async fn cell(&self, cell: &Cell) -> Result<Outcome, CampaignError> {
        let mut attempts = self.attempts_left(&self.campaign.id_of(cell));
        loop {
            let outcome = self.attempt(cell).await?;
            let Outcome::Failed(reason) = &outcome else { return Ok(outcome) };
            let id = self.campaign.id_of(cell);
            self.log(What::Failed { cell: id.clone(), reason: reason.clone() })?;
            self.laboratory.tell(News::Failed(&id, reason)).await;
            // None was left where the process was killed in an attempt that a person had asked for: this was that attempt again.
            attempts = attempts.saturating_sub(1);
            if attempts == 0 {
                self.draw(None).await;
                return Ok(outcome);
            }
            let wait_s = self.campaign.retry.wait_min.get() * 60.0;
            let wait = SignedDuration::try_from_secs_f64(wait_s).unwrap_or(SignedDuration::MAX);
            let again = self.laboratory.now().checked_add(wait).unwrap_or(jiff::Timestamp::MAX);
            if let Err(who) = self.wait(again, "to try a cell again").await {
                return Ok(Outcome::Ends(who));
            }
        }
    }

    async fn attempt(&self, cell: &Cell) -> Result<Outcome, CampaignError> {
        let id = self.campaign.id_of(cell);
        let digest = self.campaign.digest_of(cell)?;
        let (folder, known) = {
            let folder = self.folder.borrow();
            (folder.cell(&id), folder.state().cells.get(&id).cloned())
        };
        let now = self.laboratory.now();
        if known.as_ref().is_some_and(|log| log.digest != digest) && folder.exists() {
            self.folder.borrow_mut().move_aside(&id, "before-change", now)?;
        } else if known.is_some_and(|log| log.state == CellState::Measured) {
            return self.close(cell, &id).await;
        }
        let scan = match self.campaign.scan_of(cell) {
            Ok(scan) => scan,
            Err(error) => return self.fails_at_once(&id, digest, &error),
        };
        let planned = match planned_use(&scan) {
            Ok(planned) => planned,
            Err(error) => return self.fails_at_once(&id, digest, &error),
        };
        let resume = match Journal::resumable(&folder) {
            Err(JournalError::AlreadyComplete(_)) => {
                // Killed between the last reading and the line that says so.
                self.log(What::Begun { cell: id.clone(), digest })?;
                self.log(What::Measured { cell: id.clone(), used: planned })?;
                return self.close(cell, &id).await;
            }
            Ok(()) => true,
            Err(_) => {
                if folder.exists() {
                    // Killed while the record was made: it holds no reading.
                    self.folder.borrow_mut().move_aside(&id, "interrupted", now)?;
                }
                false
            }
        };
        if let Some(reason) = self.campaign.budget.refuses(self.used(), planned) {
            return Ok(Outcome::Ends(reason));
        }
        self.log(What::Begun { cell: id.clone(), digest })?;
        self.laboratory.tell(News::Begins(&id)).await;
        match self.laboratory.measure(scan, &folder, resume).await {
            Ok(Measured::Complete(used)) => {
                self.log(What::Measured { cell: id.clone(), used })?;
                self.close(cell, &id).await
            }
            // Somebody asked for this end: it is no failure of the cell.
            Ok(Measured::Partial(reason)) | Err(reason) => match self.laboratory.stop_asked() {
                Some(who) => Ok(Outcome::Ends(who.to_owned())),
                None => Ok(Outcome::Failed(reason)),
            },
        }
    }

    fn fails_at_once(
        &self,
        id: &str,
        digest: String,
        error: &dyn std::error::Error,
    ) -> Result<Outcome, CampaignError> {
        self.log(What::Begun { cell: id.to_owned(), digest })?;
        let source = error.source().map_or_else(String::new, |source| format!(": {source}"));
        Ok(Outcome::Failed(format!("{error}{source}")))
    }

    /// What was used so far. The time is that since the campaign began.
    fn used(&self) -> Use {
        let folder = self.folder.borrow();
        let state = folder.state();
        let now = self.laboratory.now();
        let time_s = now.duration_since(state.began.unwrap_or(now)).as_secs_f64();
        Use { time_s, ..state.used }
    }

    /// Does what follows a complete scan, and follows its figures.
    async fn close(&self, cell: &Cell, id: &str) -> Result<Outcome, CampaignError> {
        let folder = self.folder.borrow().cell(id);
        let problem = self.laboratory.close(cell, &folder).await.err();
        let setting = self.campaign.setting_of(cell);
        let measured = self.folder.borrow().state().cells.get(id).and_then(|log| log.measured);
        let figures = self.laboratory.figures_of(&folder, &setting, measured);
        let run = figures.as_ref().map(|figures| figures.run.clone());
        let mut alarms = Vec::new();
        let mut gap_change = None;
        if let Some(CellFigures { run, verdict }) = figures {
            let mut follower = self.follower.borrow_mut();
            let (round, folder) = (cell.round, folder.clone());
            let followed = FollowedRun { round, folder, run: run.clone(), verdict };
            alarms = follower.add(followed).into_iter().filter(|alarm| alarm.new).collect();
            gap_change = follower.gap_change(&run);
        }
        if let Some(run) = &run {
            // All alarms of a run have one cause: it is sought once.
            let before = alarms
                .first()
                .and_then(|alarm| self.follower.borrow().before(alarm, &setting).cloned());
            let cause = match before {
                Some(before) => {
                    let before = (before.folder.as_path(), before.run.at);
                    self.laboratory.explain(before, (&folder, run.at)).await
                }
                None => None,
            };
            for alarm in alarms {
                let logged =
                    What::Alarm { cell: id.to_owned(), alarm: alarm.clone(), cause: cause.clone() };
                self.log(logged)?;
                let cause = cause.as_deref();
                self.laboratory
                    .tell(News::Alarm { folder: &folder, alarm: &alarm, cause, run })
                    .await;
            }
        }
        self.log(What::Closed { cell: id.to_owned(), problem: problem.clone() })?;
        let (run, problem) = (run.as_ref(), problem.as_deref());
        self.laboratory.tell(News::Closed { folder: &folder, run, gap_change, problem }).await;
        self.draw(None).await;
        Ok(Outcome::Done)
    }
}

/// What the scan of a cell is going to take.
pub(crate) fn planned_use(
    scan: &PlannedScan,
) -> Result<Use, fieldgap_acquisition::AcquisitionError> {
    let check = scan.dry_run()?;
    // Dark readings take their share of the time without sound.
    let driven = 1.0 - check.dark as f64 / check.visits.max(1) as f64;
    Ok(Use { time_s: check.about_s, emitting_s: check.about_s * driven, way_m: check.way_m })
}
