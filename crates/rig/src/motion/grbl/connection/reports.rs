//! Status reports: what the machine is doing, and where it is.

use std::time::Duration;

use tokio::time::{Instant, sleep_until};

use super::Connection;
use crate::error::{Cause, RigError};
use crate::link::ByteLink;
use crate::motion::grbl::line::{FEED_OVERRIDE_100, STATUS_QUERY};
use crate::motion::grbl::reply::Reply;
use crate::motion::grbl::status::{Place, State, Status};
use crate::space::RobotPosition;

/// The least time between two status queries while something may be moving: a board at 8 bits has to find the time for the
/// answer.
pub(in crate::motion::grbl) const BETWEEN_QUERIES: Duration = Duration::from_millis(200);

/// Silence in which a report is lost. It is answered between two segments of a move, not behind them.
const REPORT_WITHIN: Duration = Duration::from_secs(1);

/// Queries without a report after which the machine is given up.
const MOST_QUERIES: u32 = 6;

/// State and position at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::motion::grbl) struct Observed {
    /// What it is doing.
    pub(in crate::motion::grbl) state: State,
    /// Where it is, machine coordinates.
    pub(in crate::motion::grbl) at: RobotPosition,
}

impl<L: ByteLink> Connection<L> {
    /// What the machine is doing and where, at an instant after the call.
    pub(in crate::motion::grbl) async fn status(&mut self) -> Result<Observed, RigError> {
        for _ in 0..MOST_QUERIES {
            if let Some(status) = self.query().await?
                && let Some(at) = self.machine_position(&status)
            {
                return Ok(Observed { state: status.state, at });
            }
        }
        Err(self.wire.error(Cause::Silent { waited: REPORT_WITHIN * MOST_QUERIES }))
    }

    /// As [`Connection::status`], of a machine that has just answered that its motion ended: it has the time to answer at once.
    pub(in crate::motion::grbl) async fn status_at_rest(&mut self) -> Result<Observed, RigError> {
        self.last_query = None;
        self.status().await
    }

    /// As [`Connection::status`], of a machine that may be homing: GRBL then answers afterwards, grblHAL at once.
    pub(in crate::motion::grbl) async fn status_after_homing(
        &mut self,
        within: Duration,
    ) -> Result<Observed, RigError> {
        let until = Instant::now() + within;
        loop {
            match self.status().await {
                Ok(seen) if seen.state != State::Home || Instant::now() >= until => {
                    return Ok(seen);
                }
                Err(error)
                    if !matches!(error.cause(), Cause::Silent { .. })
                        || Instant::now() >= until =>
                {
                    return Err(error);
                }
                _ => {}
            }
        }
    }

    /// The machine's state; its position may not be known yet.
    pub(in crate::motion::grbl) async fn state(&mut self) -> Result<State, RigError> {
        for _ in 0..MOST_QUERIES {
            if let Some(status) = self.query().await? {
                return Ok(status.state);
            }
        }
        Err(self.wire.error(Cause::Silent { waited: REPORT_WITHIN * MOST_QUERIES }))
    }

    /// One query and its report, `None` where it was lost. A report that may be the late answer to an earlier
    /// query is passed over.
    async fn query(&mut self) -> Result<Option<Status>, RigError> {
        if let Some(last) = self.last_query {
            sleep_until(last + BETWEEN_QUERIES).await;
        }
        self.wire.send(STATUS_QUERY).await?;
        self.last_query = Some(Instant::now());
        self.reports_due += 1;
        let until = Instant::now() + REPORT_WITHIN;
        let mut latest = None;
        while let Some(line) = self.wire.line(until).await? {
            match Reply::parse(&line) {
                Reply::Status(status) => {
                    self.note(&status);
                    latest = Some(status);
                    if self.reports_due == 0 {
                        self.mend_feed(&status).await?;
                        return Ok(latest);
                    }
                }
                // Among them answers to lines before: a dwell may end while it is asked for.
                reply => self.take(reply, line)?,
            }
        }
        // Nothing more will come: the last report, if any, is the answer to the last query.
        if latest.is_some() {
            self.reports_due = 0;
        }
        Ok(latest)
    }

    pub(super) fn note(&mut self, status: &Status) {
        self.reports_due = self.reports_due.saturating_sub(1);
        self.work_offset = status.work_offset.or(self.work_offset);
    }

    /// A feed override, left by another program or made by a damaged byte, would change every feed.
    async fn mend_feed(&mut self, status: &Status) -> Result<(), RigError> {
        match status.feed_override {
            Some(percent) if percent != 100 => {
                tracing::warn!(device = %self.wire.device(), "the feed override was {percent} % and was set to 100 %");
                self.wire.send(FEED_OVERRIDE_100).await
            }
            _ => Ok(()),
        }
    }

    /// Machine coordinates; `None` where the report has the work's and the offset has not come yet.
    fn machine_position(&self, status: &Status) -> Option<RobotPosition> {
        let place = match (status.place, self.work_offset) {
            (Place::Machine(place), _) => place,
            (Place::Work(place), Some(offset)) => {
                std::array::from_fn(|axis| place[axis] + offset[axis])
            }
            (Place::Work(_), None) => return None,
        };
        Some(RobotPosition::from_axes_mm(place.map(|value| value * self.mm_per_unit)))
    }
}
