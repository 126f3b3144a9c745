//! The sequence of a scan: homing, the check of recorded points, then leg by leg.

use std::ops::Range;

use jiff::Timestamp;

use super::{ScanRun, Stopped};
use crate::AcquisitionError;
use crate::clock::{ScanClock, goes_on_at_s};
use crate::drift::Drift;
use crate::event::{Event, EventSink};
use crate::fly::Flights;
use crate::itinerary::Itinerary;
use crate::references::{RigChange, compare};
use crate::rows::Leg;
use crate::sequencer::{PointSequencer, distance_mm};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{EventKind, VisitPace};

/// What a scan under way carries from leg to leg.
pub(super) struct Progress {
    pub(super) sequencer: PointSequencer,
    /// By the pace of their rows.
    flights: Vec<(VisitPace, Flights)>,
    drift: Option<Drift>,
    /// Where the robot stands; visits to the reference point begin there.
    at_m: Vec3,
}

/// The flights at a pace, which begin with the first row of that pace; `None` if an itinerary has no such rows.
fn flights_of<'f>(
    pace: VisitPace,
    flights: &'f mut Vec<(VisitPace, Flights)>,
    itinerary: &Itinerary,
) -> Option<&'f mut Flights> {
    let number = match flights.iter().position(|(known, _)| *known == pace) {
        Some(number) => number,
        None => {
            let begun = Flights::new(*itinerary.flight(pace)?);
            let begun = begun.handled_like(flights.first().map(|(_, flights)| flights));
            flights.push((pace, begun));
            flights.len() - 1
        }
    };
    Some(&mut flights[number].1)
}

impl ScanRun {
    /// Runs the rest of the plan.
    pub(super) async fn conduct(&mut self, watch: EventSink<'_>) -> Result<(), Stopped> {
        watch(&self.open.greeting());
        let (plan, visits) = (&self.scan.plan, &self.scan.visits);
        let itinerary = Itinerary::of(plan, &self.scan.rig_setup, visits, &self.kept);
        itinerary.fits(visits, self.open.rig().receiver().identity().rate_hz)?;
        self.open.rig().continuous_wave().await?;
        let homed = self.open.rig().home().await?;
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
        let (plan, visits) = (&self.scan.plan, &self.scan.visits);
        let drift = Drift::of(plan, visits, self.check.about_s, &self.kept);
        let mut at_m = sequencer.frame().to_array(homed);
        if let Some(&row) = itinerary.checks.last() {
            at_m = visits[row].position_m;
        }
        self.check_references(&mut sequencer, &itinerary.checks, &mut *watch).await?;
        let mut flights = Vec::new();
        if let Some(row) = &itinerary.lag_row {
            at_m = itinerary.ends_m(&Leg::Row(row.clone()), &self.scan.visits)[0];
            if let Some(flights) = flights_of(VisitPace::OfPlan, &mut flights, &itinerary) {
                self.find_lag(flights, &mut sequencer, row, &mut *watch).await?;
            }
        }
        let mut progress = Progress { sequencer, flights, drift, at_m };
        self.measure_legs(&itinerary, &mut progress, &mut *watch).await?;
        self.measure_rounds(&mut progress, &mut *watch).await?;
        for text in progress.flights.iter().filter_map(|(_, flights)| flights.evenness()) {
            self.journal.record(Timestamp::now(), EventKind::Flown, &text)?;
        }
        Ok(())
    }

    /// Measures the legs of an itinerary.
    pub(super) async fn measure_legs(
        &mut self,
        itinerary: &Itinerary,
        Progress { sequencer, flights, drift, at_m }: &mut Progress,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let mut now_s = self.kept.last().map_or(0.0, |last| last.time_s);
        for leg in &itinerary.legs {
            let mut rows = leg.rows();
            let next = self.scan.visits[rows.start];
            let [begins_m, ends_m] = itinerary.ends_m(leg, &self.scan.visits);
            let way_m = [*at_m, begins_m];
            self.revisit(sequencer, drift.as_mut(), now_s, way_m, &mut *watch).await?;
            let measured = match (leg, flights_of(next.pace, flights, itinerary)) {
                (Leg::Row(row), Some(flights)) => {
                    let mut flown = self.fly(flights, sequencer, row, &mut *watch).await?;
                    // Of a row that was interrupted some readings are kept already.
                    rows.start = self.journal.visits_done();
                    flown.split_off(rows.start - row.start)
                }
                _ => vec![self.measure(sequencer, &next, &mut *watch).await?],
            };
            *at_m = ends_m;
            now_s = measured.last().map_or(now_s, |measurement| measurement.sample.time_s);
            self.keep_row(rows, &measured, sequencer, drift.as_mut(), &mut *watch).await?;
            // Further rounds are chosen by all readings; without them the journal is enough.
            if self.rounds.is_some() {
                self.kept.extend(measured.iter().map(|measurement| measurement.sample));
            }
        }
        Ok(())
    }

    /// Finds the lag of readings in motion from a row.
    async fn find_lag(
        &mut self,
        flights: &mut Flights,
        sequencer: &mut PointSequencer,
        row: &Range<usize>,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let row = &self.scan.visits[row.clone()];
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
        rows: &[usize],
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        let mut found = Vec::new();
        for &row in rows {
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
