//! Waking from a suspension of the computer, during which array and robot went on by themselves.

use jiff::Timestamp;

use super::{ScanRun, Stopped};
use crate::event::{Event, EventSink};
use crate::sequencer::PointSequencer;
use fieldgap_records::EventKind;

impl ScanRun {
    /// Whether the computer was suspended since the last point, which is then recorded and reported.
    pub(super) fn was_suspended(&mut self, watch: EventSink<'_>) -> Result<bool, Stopped> {
        let Some(suspended) = self.suspensions.since_last() else { return Ok(false) };
        let suspended_s = suspended.as_secs_f64();
        let text = format!(
            "the computer was suspended for {suspended_s:.1} s; array and robot were not controlled meanwhile"
        );
        self.journal.record(Timestamp::now(), EventKind::Suspended, &text)?;
        watch(&Event::Suspended { suspended_s });
        Ok(true)
    }

    /// After a suspension: silences the array and confirms the robot's place. The point is then measured again, with the
    /// array set anew.
    pub(super) async fn after_suspension(
        &mut self,
        sequencer: &mut PointSequencer,
    ) -> Result<(), Stopped> {
        sequencer.silence(self.open.rig()).await?;
        let place = self.open.rig().confirm_place().await?;
        let text = format!("the robot reports the same place, {place}");
        Ok(self.journal.record(Timestamp::now(), EventKind::Suspended, &text)?)
    }
}
