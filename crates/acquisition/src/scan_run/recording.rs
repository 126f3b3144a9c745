//! Recording readings: each is on disk before the robot moves on.

use std::ops::Range;
use std::time::Duration;

use jiff::Timestamp;
use tokio::time::{Instant, sleep};

use super::{ScanRun, Stopped};
use crate::air_log::Polled;
use crate::drift::Drift;
use crate::event::{Event, EventSink};
use crate::sequencer::{Measurement, PointSequencer};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{EventKind, Journal, JournalError, RecordedSample};

/// Interval of the check for free disk space.
const FREE_SPACE_CHECK_INTERVAL: Duration = Duration::from_secs(1);

impl ScanRun {
    /// Records the measurements of some visits, and reports them.
    pub(super) async fn keep_row(
        &mut self,
        rows: Range<usize>,
        measured: &[Measurement],
        sequencer: &mut PointSequencer,
        mut drift: Option<&mut Drift>,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        for (row, &Measurement { clipped, lost, .. }) in rows.clone().zip(measured) {
            if clipped || lost > 0 {
                // Recorded before the row: if the process dies, a row without a note is a good one.
                let text = impairment(row, clipped, lost);
                let fault = |journal: &mut Journal| {
                    journal.record(Timestamp::now(), EventKind::DeviceFault, &text)
                };
                self.keep(fault, sequencer, &mut *watch).await?;
                watch(&Event::ImpairedReading { row, text });
            }
        }
        let visits = self.scan.visits[rows.clone()].to_vec();
        let points: Vec<(RecordedSample, Vec3)> = measured
            .iter()
            .zip(&visits)
            .map(|(measurement, visit)| (measurement.sample, visit.position_m))
            .collect();
        self.keep(|journal| journal.append_row(&points), sequencer, &mut *watch).await?;
        for ((row, visit), Measurement { sample, clipped, .. }) in rows.zip(&visits).zip(measured) {
            if let Some(drifted) = drift.as_mut().and_then(|drift| drift.measured(visit, sample)) {
                self.warn_of_drift(drifted, &mut *watch)?;
            }
            watch(&Event::Measured {
                row,
                of: self.scan.visits.len(),
                focus: sample.focus.map_or(-1, |focus| focus as i64),
                at_mm: sample.position_mm.into(),
                time_s: sample.time_s,
                reading: sample.reading,
                clipped: *clipped,
            });
        }
        if let Some((sample, _)) = points.last() {
            self.log_air(sample.time_s).await;
        }
        Ok(())
    }

    /// Writes to the journal. If the disk is full, silences the array and waits for free space.
    async fn keep(
        &mut self,
        mut keep: impl FnMut(&mut Journal) -> Result<(), JournalError>,
        sequencer: &mut PointSequencer,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        match keep(&mut self.journal) {
            Err(error) if error.is_no_room() => {
                sequencer.silence(self.open.rig()).await?;
                watch(&Event::DiskFull { reason: error.to_string() });
            }
            kept => return Ok(kept?),
        }
        let since = Instant::now();
        loop {
            sleep(FREE_SPACE_CHECK_INTERVAL).await;
            match keep(&mut self.journal) {
                Err(error) if error.is_no_room() => {}
                kept => {
                    kept?;
                    break;
                }
            }
        }
        let waited_s = since.elapsed().as_secs_f64();
        let text = format!("there was no room on the disk for {waited_s:.0} s");
        watch(&Event::DiskSpaceFreed { waited_s });
        // If the disk is full again, the next reading waits.
        match self.journal.record(Timestamp::now(), EventKind::Waited, &text) {
            Err(error) if !error.is_no_room() => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Records the environment sensor. If it fails, that is noted and the scan continues.
    async fn log_air(&mut self, time_s: f64) {
        let Some(air) = self.open.air() else { return };
        let text = match air.poll(time_s).await {
            Polled::Kept => return,
            Polled::Lost(reason) => reason,
            Polled::Back => "the environment sensor is back".to_owned(),
        };
        tracing::warn!("{text}");
        // If the disk is full, the next reading reports it.
        let _ = self.journal.record(Timestamp::now(), EventKind::DeviceFault, &text);
    }
}

/// What impairs the reading of a row.
fn impairment(row: usize, clipped: bool, lost: u32) -> String {
    let clipped = if clipped { ", the converter was at its limit" } else { "" };
    let lost =
        if lost > 0 { format!(", {lost} samples were lost on their way") } else { String::new() };
    format!("row {row}{clipped}{lost}")
}
