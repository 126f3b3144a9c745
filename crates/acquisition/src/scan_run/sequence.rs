//! The sequence of a scan: homing, the check of recorded points, then leg by leg.

use jiff::Timestamp;

use super::{ScanRun, Stopped};
use crate::AcquisitionError;
use crate::clock::{ScanClock, goes_on_at_s};
use crate::drift::Drift;
use crate::event::{Event, EventSink};
use crate::fly::{Flight, Flights};
use crate::references::{RigChange, compare, reference_rows};
use crate::rows::{Leg, Line, legs};
use crate::sequencer::{PointSequencer, distance_mm};
use fieldgap_records::{EventKind, Visit};

impl ScanRun {
    /// Runs the rest of the plan.
    pub(super) async fn conduct(&mut self, watch: EventSink<'_>) -> Result<(), Stopped> {
        watch(&self.open.greeting());
        self.open.rig().continuous_wave().await?;
        self.open.rig().home().await?;
        self.journal.record(Timestamp::now(), EventKind::Homed, "")?;
        watch(&Event::Homed);
        let clock = match self.kept.last() {
            None => ScanClock::from_start(),
            Some(last) => ScanClock::from(goes_on_at_s(
                self.setup.recorded,
                last.time_s,
                self.scan.rig_setup.is_virtual(),
            )),
        };
        let mut sequencer = PointSequencer::new(&self.scan.rig_setup, &self.scan.plan.foci, clock);
        self.check_references(&mut sequencer, &mut *watch).await?;
        let (plan, visits) = (&self.scan.plan, &self.scan.visits);
        let mut flights = plan.fly.map(|fly| Flights::new(Flight::new(&fly, &self.scan.rig_setup)));
        let legs = legs(visits, self.journal.visits_done(), flights.is_some());
        let mut drift = Drift::of(plan, visits, self.check.about_s, &self.kept);
        let mut last = self.kept.last().copied();
        if let Some(flights) = flights.as_mut().filter(|flights| flights.want_lag()) {
            self.find_lag(flights, &mut sequencer, &legs, &mut *watch).await?;
        }
        for leg in legs {
            let rows = leg.rows();
            let next = self.scan.visits[rows.start];
            self.revisit(&mut sequencer, drift.as_mut(), last.as_ref(), &next, &mut *watch).await?;
            let measured = match (&leg, &mut flights) {
                (Leg::Row(row), Some(flights)) => {
                    self.fly(flights, &mut sequencer, row, &mut *watch).await?
                }
                _ => vec![self.measure(&mut sequencer, &next, &mut *watch).await?],
            };
            last = measured.last().map(|measurement| measurement.sample);
            self.keep_row(rows, &measured, &mut sequencer, drift.as_mut(), &mut *watch).await?;
        }
        if let Some(text) = flights.and_then(|flights| flights.evenness()) {
            self.journal.record(Timestamp::now(), EventKind::Flown, &text)?;
        }
        Ok(())
    }

    /// Finds the lag of readings in motion from the row that passes nearest to its focus.
    async fn find_lag(
        &mut self,
        flights: &mut Flights,
        sequencer: &mut PointSequencer,
        legs: &[Leg],
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let visits = &self.scan.visits;
        let rows = legs.iter().filter_map(|leg| match leg {
            Leg::Row(row) => Some(&visits[row.clone()]),
            Leg::Stop(_) => None,
        });
        let from_focus_m = |row: &[Visit]| {
            let focus = row[0].focus.map(|focus| self.scan.plan.foci[focus].excitation());
            let focus_m = focus.and_then(|excitation| excitation.focus_m());
            Line::of(row).distance_m(focus_m.unwrap_or_default())
        };
        let nearest = rows.min_by(|a, b| from_focus_m(a).total_cmp(&from_focus_m(b)));
        let Some(row) = nearest else { return Ok(()) };
        let lag = flights.find_lag(sequencer, self.open.rig(), row).await?;
        let (lag_ms, standard_error_ms) = (lag.lag_s * 1e3, lag.standard_error_s * 1e3);
        let text = format!("readings lag {lag_ms:.3} ± {standard_error_ms:.3} ms behind the robot");
        self.journal.record(Timestamp::now(), EventKind::Flown, &text)?;
        watch(&Event::LagFound { lag_ms, standard_error_ms });
        Ok(())
    }

    /// Measures some recorded points again, and fails if the rig has changed.
    async fn check_references(
        &mut self,
        sequencer: &mut PointSequencer,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let mut found = Vec::new();
        for row in reference_rows(&self.kept, &self.scan.visits) {
            let kept = &self.kept[row];
            let now = sequencer.measure(self.open.rig(), &self.scan.visits[row]).await?.sample;
            watch(&Event::ReferenceChecked {
                row,
                kept: kept.reading,
                now: now.reading,
                moved_mm: distance_mm(kept.position_m(), now.position_m()),
            });
            let verdict = compare(row, kept, &now, self.scan.plan.resume);
            let text = match &verdict {
                Ok(()) => format!("row {row}: {} where {} was kept", now.reading, kept.reading),
                Err(moved) => moved.to_string(),
            };
            self.journal.record(Timestamp::now(), EventKind::ReferenceChecked, &text)?;
            found.extend(verdict.err());
        }
        Ok(RigChange::of(found).map_err(AcquisitionError::from)?)
    }
}
