//! Waiting for the watchdog process: without it the robot does not move and the array is silent.

use std::time::Duration;

use jiff::Timestamp;
use tokio::time::{Instant, timeout};

use super::{ScanRun, Stopped};
use crate::AcquisitionError;
use crate::event::{Event, EventSink};
use crate::sequencer::PointSequencer;
use fieldgap_records::EventKind;

/// How long another watchdog is waited for: about twenty attempts to start one.
const WAIT_AT_MOST: Duration = Duration::from_secs(20);

impl ScanRun {
    /// If the watchdog was lost since the last point, silences the array and waits until another guards.
    pub(super) async fn wait_for_watchdog(
        &mut self,
        sequencer: &mut PointSequencer,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let Some(mut standing) = self.open.standing() else { return Ok(()) };
        let now = standing.borrow().clone();
        if now.losses == self.losses && !now.unguarded {
            return Ok(());
        }
        let since = Instant::now();
        sequencer.silence(self.open.rig()).await?;
        let text = format!("the watchdog {}; the array is silent", now.reason);
        self.journal.record(Timestamp::now(), EventKind::Watchdog, &text)?;
        watch(&Event::WatchdogLost { reason: now.reason });
        let guarded = timeout(WAIT_AT_MOST, standing.wait_for(|standing| !standing.unguarded));
        let guarded = guarded.await.is_ok_and(|standing| standing.is_ok());
        let now = standing.borrow().clone();
        if !guarded {
            let (reason, waited) = (now.reason, WAIT_AT_MOST);
            return Err(AcquisitionError::Unguarded { reason, waited }.into());
        }
        self.losses = now.losses;
        let waited_s = since.elapsed().as_secs_f64();
        let text = format!("the watchdog was started again after {waited_s:.1} s");
        self.journal.record(Timestamp::now(), EventKind::Watchdog, &text)?;
        watch(&Event::WatchdogRestarted { waited_s });
        Ok(())
    }
}
