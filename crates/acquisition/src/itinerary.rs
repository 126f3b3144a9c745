//! The moves of a scan, in order. The dry run checks this list, and the scan then makes its moves: nothing moves that was
//! not checked.

use std::ops::Range;

use super::error::AcquisitionError;
use super::fly::Flight;
use super::references::reference_rows;
use super::rig_setup::RigSetup;
use super::rows::{Leg, Line, legs};
use fieldgap_acoustics::Vec3;
use fieldgap_records::{Plan, RecordedSample, Visit, VisitPace};

/// What a scan does between homing and its end. Visits to the reference point that become due by time are made between
/// two legs, only where both ways are free; they are not part of this list.
#[derive(Debug, Clone)]
pub(super) struct Itinerary {
    /// Recorded rows that a resumed scan measures again first.
    pub(super) checks: Vec<usize>,
    /// The row that is scanned in both directions to find the lag of the readings.
    pub(super) lag_row: Option<Range<usize>>,
    /// The legs of the plan.
    pub(super) legs: Vec<Leg>,
    /// How rows of each pace are flown.
    flights: Vec<(VisitPace, Flight)>,
}

/// One move of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Station {
    /// Where to, array frame, m.
    pub(super) to_m: Vec3,
    /// The visit for which it is made.
    pub(super) visit: usize,
    /// What it is for.
    pub(super) purpose: Purpose,
}

/// What a move is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A reading at standstill.
    Point,
    /// The run-up of a pass.
    Approach,
    /// A pass over a row, recorded on the way.
    Pass,
}

impl Itinerary {
    /// The moves of a plan of which `kept` is already measured.
    pub(super) fn of(
        plan: &Plan,
        rig_setup: &RigSetup,
        visits: &[Visit],
        kept: &[RecordedSample],
    ) -> Self {
        let fly = plan.fly.as_ref();
        let legs = legs(visits, kept.len(), fly.is_some());
        let mut flights: Vec<(VisitPace, Flight)> = Vec::new();
        for row in rows(&legs) {
            let pace = visits[row.start].pace;
            if flights.iter().all(|(known, _)| *known != pace) {
                let flight = match pace {
                    VisitPace::Flown(speed) => Some(Flight::listed(speed, fly, rig_setup)),
                    _ => fly.map(|fly| Flight::new(fly, rig_setup)),
                };
                flights.extend(flight.map(|flight| (pace, flight)));
            }
        }
        let wants_lag = flights.iter().any(|(_, flight)| flight.wants_lag());
        let lag_row = wants_lag.then(|| nearest_to_its_focus(plan, &legs, visits)).flatten();
        Self { checks: reference_rows(kept, visits), lag_row, legs, flights }
    }

    /// Checks that a receiver is fast enough for every row.
    ///
    /// # Errors
    /// [`FlightFault::TooFast`](super::error::FlightFault::TooFast).
    pub(super) fn fits(&self, visits: &[Visit], rate_hz: f64) -> Result<(), AcquisitionError> {
        for row in rows(&self.legs) {
            if let Some(flight) = self.flight(visits[row.start].pace) {
                flight.fits(&Line::of(&visits[row.clone()]), rate_hz)?;
            }
        }
        Ok(())
    }

    /// How rows of a pace are scanned in motion; `None` if there are none.
    pub(super) fn flight(&self, pace: VisitPace) -> Option<&Flight> {
        self.flights.iter().find(|(known, _)| *known == pace).map(|(_, flight)| flight)
    }

    /// Where the robot stands before and after a leg, array frame, m.
    pub(super) fn ends_m(&self, leg: &Leg, visits: &[Visit]) -> [Vec3; 2] {
        let first = visits[leg.rows().start];
        match (leg, self.flight(first.pace)) {
            (Leg::Row(row), Some(flight)) => Line::of(&visits[row.clone()]).ends_m(flight.lead_m()),
            _ => [first.position_m; 2],
        }
    }

    /// All moves, in order.
    pub(super) fn stations(&self, visits: &[Visit]) -> Vec<Station> {
        let point = |visit: usize| {
            let to_m = visits[visit].position_m;
            Station { to_m, visit, purpose: Purpose::Point }
        };
        let pass = |visit: usize, [begins_m, ends_m]: [Vec3; 2]| {
            [(begins_m, Purpose::Approach), (ends_m, Purpose::Pass)]
                .map(|(to_m, purpose)| Station { to_m, visit, purpose })
        };
        let mut stations: Vec<Station> = self.checks.iter().map(|&row| point(row)).collect();
        if let Some(row) = &self.lag_row {
            let [begins_m, ends_m] = self.ends_m(&Leg::Row(row.clone()), visits);
            stations.extend(pass(row.start, [begins_m, ends_m]));
            stations.extend(pass(row.start, [ends_m, begins_m]));
        }
        for leg in &self.legs {
            match leg {
                Leg::Stop(visit) => stations.push(point(*visit)),
                Leg::Row(row) => stations.extend(pass(row.start, self.ends_m(leg, visits))),
            }
        }
        stations
    }
}

/// The rows among some legs.
fn rows(legs: &[Leg]) -> impl Iterator<Item = &Range<usize>> {
    legs.iter().filter_map(|leg| match leg {
        Leg::Row(row) => Some(row),
        Leg::Stop(_) => None,
    })
}

/// The row that passes nearest to the focus with which it is scanned, of those whose pace the plan leaves to `[fly]`.
fn nearest_to_its_focus(plan: &Plan, legs: &[Leg], visits: &[Visit]) -> Option<Range<usize>> {
    let from_focus_m = |row: &Range<usize>| {
        let focus = visits[row.start].focus.map(|focus| plan.foci[focus].excitation());
        let focus_m = focus.and_then(|excitation| excitation.focus_m());
        Line::of(&visits[row.clone()]).distance_m(focus_m.unwrap_or_default())
    };
    let rows = rows(legs).filter(|row| visits[row.start].pace == VisitPace::OfPlan);
    rows.min_by(|a, b| from_focus_m(a).total_cmp(&from_focus_m(b))).cloned()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::PlannedScan;
    use fieldgap_input::{Fault, TomlSource};
    use fieldgap_records::VisitKind;

    const PLAN: &str = "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0\ny_mm = 0\nz_mm = 100\n\
                        [[plane]]\nz_mm = 100\nsize_mm = [60, 60]\nstep_mm = 2\n";

    fn scan(more: &str, box_mm: &str) -> PlannedScan {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
        let rig = std::fs::read_to_string(&path).expect("the rig file is there");
        let rig = rig.replace("[motion.marlin]", &format!("{box_mm}\n[motion.marlin]"));
        let plan = TomlSource::new(Path::new("plan.toml"), format!("{PLAN}{more}"));
        PlannedScan::parse(plan, TomlSource::new(&path, rig)).expect("valid")
    }

    fn checked(scan: &PlannedScan, kept: &[RecordedSample]) -> Result<(), Fault> {
        crate::dry_run::dry_run(&scan.plan, &scan.rig_setup, &scan.visits, kept).map(drop)
    }

    /// On the straight way from home to the row through the focus, and beside that to the first row.
    const POST: &str =
        "[[motion.keep_out]]\nname = \"post\"\nmin_mm = [88, 72, 38]\nmax_mm = [93, 78, 42]";

    #[test]
    fn the_way_to_the_row_for_the_lag_is_checked() {
        checked(&scan("[fly]\nspeed_mm_s = 40\n", ""), &[]).expect("free");
        checked(&scan("[fly]\nspeed_mm_s = 40\nlag_ms = 3\n", POST), &[]).expect("not on the way");
        let fault = checked(&scan("[fly]\nspeed_mm_s = 40\n", POST), &[]).expect_err("in the way");
        assert!(fault.to_string().contains("post"), "{fault}");
    }

    #[test]
    fn the_points_that_a_resumed_scan_measures_again_are_checked() {
        let free = scan("", "");
        let kept: Vec<RecordedSample> = free.visits[..500]
            .iter()
            .enumerate()
            .map(|(row, visit)| {
                let reading = if row == 15 * 31 + 15 { 2.0 } else { 1.0 };
                RecordedSample::measured(row as f64, visit.focus, visit.position_m, reading, None)
            })
            .collect();
        let itinerary = Itinerary::of(&free.plan, &free.rig_setup, &free.visits, &kept);
        assert!(itinerary.checks.contains(&(15 * 31 + 15)), "{:?}", itinerary.checks);
        checked(&free, &kept).expect("free");
        // At half of the way from home to the first of them.
        let first = free.visits[itinerary.checks[0]].position_m * 1e3;
        let half_mm = [(150.0 + first.x) / 2.0, (150.0 + first.y) / 2.0, (first.z - 20.0) / 2.0];
        let [low, high] = [-2.0, 2.0].map(|by| half_mm.map(|mm| mm + by));
        let post =
            format!("[[motion.keep_out]]\nname = \"post\"\nmin_mm = {low:?}\nmax_mm = {high:?}");
        let blocked = scan("", &post);
        checked(&blocked, &[]).expect("not on the way of the whole plan");
        let ways = itinerary.stations(&free.visits);
        assert_eq!(ways.len(), itinerary.checks.len() + free.visits.len() - kept.len());
        let fault = checked(&blocked, &kept).expect_err("in the way");
        assert!(fault.to_string().contains("post"), "{fault}");
    }

    #[test]
    fn every_row_has_a_run_up_and_the_lag_is_found_on_the_row_through_the_focus() {
        let scan = scan("[fly]\nspeed_mm_s = 40\n", "");
        let itinerary = Itinerary::of(&scan.plan, &scan.rig_setup, &scan.visits, &[]);
        let row = itinerary.lag_row.clone().expect("it is wanted");
        assert!(scan.visits[row.start].position_m.y.abs() < 1e-9);
        let stations = itinerary.stations(&scan.visits);
        assert_eq!(stations.len(), 4 + 2 * 31);
        let passes = stations.iter().filter(|station| station.purpose == Purpose::Pass);
        assert_eq!(passes.count(), 2 + 31);
        let lead_m = (stations[0].to_m - scan.visits[row.start].position_m).norm();
        assert!(lead_m > 0.5e-3, "{lead_m}");
        assert!(scan.visits.iter().all(|visit| visit.kind == VisitKind::Point));
    }
}
