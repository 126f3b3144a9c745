//! What was measured, kept: on disk before the robot goes on, and told of.

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

/// How often it is looked whether there is room again.
const LOOK_FOR_ROOM_EVERY: Duration = Duration::from_secs(1);

impl ScanRun {
    /// Keeps the measurements of some visits, and tells of them.
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
                // Kept before the row: a row without a word about it is a good one, whenever the process dies.
                let text = spoilt(row, clipped, lost);
                let fault = |journal: &mut Journal| {
                    journal.record(Timestamp::now(), EventKind::DeviceFault, &text)
                };
                self.keep(fault, sequencer, &mut *watch).await?;
                watch(&Event::Spoilt { row, text });
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
                self.tell_drift(drifted, &mut *watch)?;
            }
            watch(&Event::Measured {
                row,
                of: self.scan.visits.len(),
                focus: sample.focus.map_or(-1, |focus| focus as i64),
                at_mm: sample.position_mm.into(),
                reading: sample.reading,
                clipped: *clipped,
            });
        }
        if let Some((sample, _)) = points.last() {
            self.watch_the_air(sample.time_s).await;
        }
        Ok(())
    }

    /// Keeps something; where there is no room for it, silences the array and waits until there is.
    async fn keep(
        &mut self,
        mut keep: impl FnMut(&mut Journal) -> Result<(), JournalError>,
        sequencer: &mut PointSequencer,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        match keep(&mut self.journal) {
            Err(error) if error.is_no_room() => {
                sequencer.silence(self.open.rig()).await?;
                watch(&Event::Waiting { reason: error.to_string() });
            }
            kept => return Ok(kept?),
        }
        let since = Instant::now();
        loop {
            sleep(LOOK_FOR_ROOM_EVERY).await;
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
        watch(&Event::WentOn { waited_s });
        // Where this finds no room again, the next reading waits.
        match self.journal.record(Timestamp::now(), EventKind::Waited, &text) {
            Err(error) if !error.is_no_room() => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Keeps what the environment sensor says; one that fails ends no scan, and is told of.
    async fn watch_the_air(&mut self, time_s: f64) {
        let Some(air) = self.open.air() else { return };
        let text = match air.poll(time_s).await {
            Polled::Kept => return,
            Polled::Lost(reason) => reason,
            Polled::Back => "the environment sensor is back".to_owned(),
        };
        tracing::warn!("{text}");
        // Where the disk is full, the next reading tells of it.
        let _ = self.journal.record(Timestamp::now(), EventKind::DeviceFault, &text);
    }
}

/// What is not as it should be with the readings behind a row.
fn spoilt(row: usize, clipped: bool, lost: u32) -> String {
    let clipped = if clipped { ", the converter was at its limit" } else { "" };
    let lost =
        if lost > 0 { format!(", {lost} samples were lost on their way") } else { String::new() };
    format!("row {row}{clipped}{lost}")
}
