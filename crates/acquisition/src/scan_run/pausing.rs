//! Measuring with pauses, visits to the reference point, and drift warnings.

use std::ops::Range;

use jiff::Timestamp;
use tokio::time::Instant;

use super::{ScanRun, Stopped};
use crate::AcquisitionError;
use crate::drift::{Drift, Drifted};
use crate::event::{Event, EventSink};
use crate::fly::Flights;
use crate::sequencer::{Measurement, PointSequencer};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{EventKind, Visit};

impl ScanRun {
    /// Measures a visit. If a pause is requested, the scan waits with the array silent and then measures the point again.
    pub(super) async fn measure(
        &mut self,
        sequencer: &mut PointSequencer,
        visit: &Visit,
        watch: EventSink<'_>,
    ) -> Result<Measurement, Stopped> {
        loop {
            if self.pause.is_asked() {
                self.wait(sequencer, &mut *watch).await?;
            }
            self.wait_for_watchdog(sequencer, &mut *watch).await?;
            let measured = sequencer.measure(self.open.rig(), visit).await;
            let suspended = self.was_suspended(&mut *watch)?;
            let measurement = measured?;
            if suspended {
                self.after_suspension(sequencer).await?;
            } else if !self.pause.is_asked() {
                return Ok(measurement);
            }
        }
    }

    /// Measures a row in motion, with pauses as in [`ScanRun::measure`].
    pub(super) async fn fly(
        &mut self,
        flights: &mut Flights,
        sequencer: &mut PointSequencer,
        row: &Range<usize>,
        watch: EventSink<'_>,
    ) -> Result<Vec<Measurement>, Stopped> {
        loop {
            if self.pause.is_asked() {
                self.wait(sequencer, &mut *watch).await?;
            }
            self.wait_for_watchdog(sequencer, &mut *watch).await?;
            let visits = &self.scan.visits[row.clone()];
            let measured = flights.measure(sequencer, self.open.rig(), visits).await;
            let suspended = self.was_suspended(&mut *watch)?;
            let measured = measured?;
            if suspended {
                self.after_suspension(sequencer).await?;
            } else if !self.pause.is_asked() {
                return Ok(measured);
            }
        }
    }

    /// Waits until the scan may continue. The array is silent, the robot stays where it is.
    async fn wait(
        &mut self,
        sequencer: &mut PointSequencer,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let since = Instant::now();
        sequencer.silence(self.open.rig()).await?;
        self.journal.record(Timestamp::now(), EventKind::Paused, "the array is silent")?;
        watch(&Event::Paused);
        self.pause.over().await;
        let waited_s = since.elapsed().as_secs_f64();
        self.journal.record(Timestamp::now(), EventKind::Continued, &format!("{waited_s:.1} s"))?;
        watch(&Event::Continued { waited_s });
        Ok(())
    }

    /// Measures the reference point if that is due at scan time `now_s`, and free on the way from where the robot stands to where
    /// the next leg begins.
    pub(super) async fn revisit(
        &mut self,
        sequencer: &mut PointSequencer,
        drift: Option<&mut Drift>,
        now_s: f64,
        [at_m, next_m]: [Vec3; 2],
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let motion = &self.scan.rig_setup.rig.motion;
        let robot = (&motion.envelope(), &motion.frame());
        let Some((drift, visit)) = drift.and_then(|drift| {
            let visit = drift.due(now_s, at_m, next_m, robot)?;
            Some((drift, visit))
        }) else {
            return Ok(());
        };
        let sample = self.measure(sequencer, &visit, &mut *watch).await?.sample;
        let drifted = drift.read(&sample);
        let text = format!(
            "reference point: {} where {} was first ({:+.2} %), {:.3} mm apart",
            drifted.now,
            drifted.first,
            drifted.percent(),
            drifted.moved_mm
        );
        self.journal.record(Timestamp::now(), EventKind::ReferenceChecked, &text)?;
        watch(&Event::ReferenceRevisited {
            at_mm: sample.position_mm.into(),
            first: drifted.first,
            now: drifted.now,
            moved_mm: drifted.moved_mm,
        });
        Ok(self.warn_of_drift(drifted, watch)?)
    }

    /// Warns if the level at the reference point has drifted too far.
    pub(super) fn warn_of_drift(
        &mut self,
        drifted: Drifted,
        watch: EventSink<'_>,
    ) -> Result<(), AcquisitionError> {
        if drifted.is_news {
            let text = format!(
                "the level at the reference point is {:.5} and was {:.5} at first ({:+.1} %): check the array, the receiver and the air",
                drifted.now,
                drifted.first,
                drifted.percent()
            );
            self.journal.record(Timestamp::now(), EventKind::Question, &text)?;
            watch(&Event::Question { text });
        }
        Ok(())
    }
}
