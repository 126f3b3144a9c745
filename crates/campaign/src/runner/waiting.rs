//! Waiting for rounds and for permitted times, and reasons to end.

use jiff::{SignedDuration, Timestamp};

use super::Runner;
use crate::laboratory::News;

/// Longest wait without a look at whether somebody asked to stop.
const LONGEST: SignedDuration = SignedDuration::from_hours(24);

impl Runner<'_> {
    /// Waits for the start of the next round; gives how many starts passed during the one before, or why there is no further round.
    pub(super) async fn wait_for_round(&self) -> Result<u32, String> {
        let schedule = &self.campaign.schedule;
        let (began, last) = {
            let folder = self.folder.borrow();
            let state = folder.state();
            let now = self.laboratory.now();
            (state.began.unwrap_or(now), state.rounds.last().copied())
        };
        let now = self.laboratory.now();
        let left_out = last.map_or(0, |last| schedule.starts_between(began, last, now));
        let Some(start) = schedule.start_from(began, if last.is_none() { began } else { now })
        else {
            return Err("the schedule has no further start".to_owned());
        };
        self.wait(start.max(now), "for the next round").await?;
        Ok(left_out)
    }

    /// Waits until a cell may begin. A reason where the campaign has to end instead.
    pub(super) async fn must_end(&self) -> Option<String> {
        let now = self.laboratory.now();
        match self.campaign.schedule.may_begin(now) {
            Some(at) => self.wait(at, "for the hours in which cells may begin").await.err(),
            None => Some("no cell may begin within a year, by `days` and `window`".to_owned()),
        }
    }

    /// Waits until a time.
    ///
    /// # Errors
    /// Who asked to stop.
    pub(super) async fn wait(&self, at: Timestamp, what: &'static str) -> Result<(), String> {
        if at > self.laboratory.now() {
            self.laboratory.tell(News::Waits(at, what)).await;
        }
        loop {
            if let Some(who) = self.laboratory.stop_asked() {
                return Err(who.to_owned());
            }
            let now = self.laboratory.now();
            if now >= at {
                return Ok(());
            }
            let next = now.checked_add(LONGEST).map_or(at, |soon| soon.min(at));
            self.laboratory.wait_until(next).await;
        }
    }
}
