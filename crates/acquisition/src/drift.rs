//! Drift during a scan, seen at a reference point that is measured again at intervals.
//!
//! These readings are written to `events.jsonl` and not to the samples, whose rows are the visits of the plan. Visits of the
//! plan to its reference point count as well.

use super::references::standard_error;
use super::sequencer::distance_mm;
use fieldgap_acoustics::Vec3;
use fieldgap_records::{Plan, PlanPart, RecordedSample, Visit, VisitKind, VisitPace};
use fieldgap_rig::{Envelope, Frame};

/// Standard errors that two readings of one level may differ by.
const STANDARD_ERRORS: f64 = 4.0;

/// The reference point of a scan and its drift.
#[derive(Debug)]
pub(super) struct Drift {
    visit: Visit,
    /// Interval between visits, s; `None` if only the visits of the plan count.
    every_s: Option<f64>,
    /// Allowed relative change of the level.
    bound: f64,
    /// The first reading there.
    first: Option<RecordedSample>,
    /// Scan time of the last reading there, s.
    read_at_s: f64,
    /// Change of the level at the last warning, in units of `bound`.
    told: f64,
}

/// What a reading of the reference point shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drifted {
    pub(super) first: f64,
    pub(super) now: f64,
    pub(super) moved_mm: f64,
    /// Whether to warn: the level has changed by more than allowed, and by more than at the last warning.
    pub(super) is_news: bool,
}

impl Drifted {
    /// The change since the first reading, percent.
    pub(super) fn percent(&self) -> f64 {
        (self.now / self.first - 1.0) * 100.0
    }
}

impl Drift {
    /// For a plan that takes `about_s`, of which `kept` is already measured. A scan shorter than the interval makes no
    /// extra visits.
    pub(super) fn of(
        plan: &Plan,
        visits: &[Visit],
        about_s: f64,
        kept: &[RecordedSample],
    ) -> Option<Self> {
        let reference = &plan.reference;
        let every_s = Some(reference.every_min.get() * 60.0).filter(|&s| s > 0.0 && about_s > s);
        let of_plan = |visit: &&Visit| visit.kind == VisitKind::Reference;
        let visit = match (visits.iter().find(of_plan), reference.at_mm) {
            (Some(&visit), _) => visit,
            (None, Some(at_mm)) => revisit(reference.focus, at_mm / 1e3),
            (None, None) => {
                let first = visits.iter().find(|visit| visit.kind == VisitKind::Point)?;
                Visit { kind: VisitKind::Reference, ..*first }
            }
        };
        let mut drift = Self {
            visit,
            every_s,
            bound: reference.drift_percent.get() / 100.0,
            first: None,
            read_at_s: f64::NEG_INFINITY,
            told: 1.0,
        };
        for (visit, sample) in visits.iter().zip(kept) {
            drift.measured(visit, sample);
        }
        Some(drift)
    }

    /// Takes a measured visit of the plan. Returns the drift if it was a visit to the reference point.
    pub(super) fn measured(&mut self, visit: &Visit, sample: &RecordedSample) -> Option<Drifted> {
        (visit.kind == VisitKind::Reference).then(|| self.read(sample))
    }

    /// The visit that is due at scan time `now_s`, if the robot can move straight there from `at_m` and on to `next_m`. A
    /// visit that is not possible now is made before a later point.
    pub(super) fn due(
        &self,
        now_s: f64,
        at_m: Vec3,
        next_m: Vec3,
        (envelope, frame): (&Envelope, &Frame),
    ) -> Option<Visit> {
        let every_s = self.every_s?;
        if now_s - self.read_at_s < every_s {
            return None;
        }
        let place = frame.to_robot(self.visit.position_m);
        let free = |from_m: Vec3| envelope.check_path(frame.to_robot(from_m), place).is_ok();
        let free = free(at_m)
            && envelope.check_path(place, frame.to_robot(next_m)).is_ok()
            && envelope.check_target(place).is_ok();
        free.then_some(self.visit)
    }

    /// Takes a reading of the reference point.
    pub(super) fn read(&mut self, now: &RecordedSample) -> Drifted {
        self.read_at_s = now.time_s;
        let first = *self.first.get_or_insert(*now);
        let noise = STANDARD_ERRORS * standard_error(&first).hypot(standard_error(now));
        let change = (now.reading - first.reading).abs() - noise;
        let bounds = change / (self.bound * first.reading).max(f64::MIN_POSITIVE);
        let is_news = bounds > self.told;
        if is_news {
            // The next warning comes at the next multiple of the bound.
            self.told = bounds.floor() + 1.0;
        }
        Drifted {
            first: first.reading,
            now: now.reading,
            moved_mm: distance_mm(first.position_m(), now.position_m()),
            is_news,
        }
    }
}

fn revisit(focus: usize, position_m: Vec3) -> Visit {
    Visit {
        kind: VisitKind::Reference,
        focus: Some(focus),
        position_m,
        pace: VisitPace::AtRest,
        part: PlanPart::Reference,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::TomlSource;
    use fieldgap_records::Spread;
    use fieldgap_rig::travel::{AxisBox, KeepOut};

    const PLAN: &str = "name = \"p\"\n[simulator]\nmodel = \"corrected\"\n\
        [[focus]]\nx_mm = 1.0\ny_mm = 2.0\nz_mm = 100.0\n\
        [[plane]]\nz_mm = 100.0\nsize_mm = [4.0, 4.0]\nstep_mm = 2.0\n";

    fn drift(extra: &str, about_s: f64) -> Drift {
        let text = format!("{PLAN}{extra}");
        let plan = Plan::parse(TomlSource::new(Path::new("p.toml"), text)).expect("a plan");
        Drift::of(&plan, &plan.visits(), about_s, &[]).expect("it has a focus")
    }

    fn sample(time_s: f64, reading: f64) -> RecordedSample {
        let spread = Some(Spread { std: 0.004, count: 16 });
        RecordedSample::measured(time_s, Some(0), Vec3::new(1e-3, 2e-3, 0.1), reading, spread)
    }

    fn robot() -> (Envelope, Frame) {
        let travel = AxisBox { least_m: [-1.0; 3], largest_m: [1.0; 3] };
        (Envelope { travel, keep_out: Vec::new() }, Frame { origin_m: Vec3::zeros() })
    }

    fn is_due(drift: &Drift, now_s: f64) -> bool {
        let (envelope, frame) = robot();
        drift.due(now_s, Vec3::zeros(), Vec3::new(0.0, 0.0, 0.1), (&envelope, &frame)).is_some()
    }

    #[test]
    fn it_is_read_at_the_start_and_every_fifteen_minutes() {
        let mut drift = drift("", 3600.0);
        assert!(is_due(&drift, 0.0));
        drift.read(&sample(0.0, 2.0));
        assert!(!is_due(&drift, 899.0));
        assert!(is_due(&drift, 900.0));
        drift.read(&sample(901.0, 2.0));
        assert!(!is_due(&drift, 1800.0) && is_due(&drift, 1801.0));
    }

    #[test]
    fn a_short_scan_makes_no_extra_visits() {
        assert!(!is_due(&drift("", 899.0), 0.0));
        assert!(!is_due(&drift("[reference]\nevery_min = 0\n", 1e6), 1e5));
        assert!(is_due(&drift("[reference]\nevery_min = 1\n", 61.0), 0.0));
    }

    #[test]
    fn a_drift_is_reported_once_and_again_when_it_grows() {
        let mut drift = drift("", 3600.0);
        assert!(!drift.read(&sample(0.0, 2.0)).is_news);
        assert!(!drift.read(&sample(900.0, 2.05)).is_news, "2.5 %");
        let drifted = drift.read(&sample(1800.0, 1.9));
        assert!(drifted.is_news);
        assert!((drifted.percent() + 5.0).abs() < 1e-9);
        assert!(!drift.read(&sample(2700.0, 1.9)).is_news, "told already");
        assert!(drift.read(&sample(3600.0, 1.8)).is_news, "10 %");
    }

    #[test]
    fn what_stands_in_the_way_puts_it_off() {
        let drift = drift("", 3600.0);
        let (mut envelope, frame) = robot();
        envelope.keep_out.push(KeepOut {
            name: "post".into(),
            space: AxisBox { least_m: [0.04, -1.0, -1.0], largest_m: [0.05, 1.0, 1.0] },
        });
        let due = |at_m: Vec3| drift.due(0.0, at_m, Vec3::zeros(), (&envelope, &frame));
        assert!(due(Vec3::new(0.1, 0.0, 0.1)).is_none());
        assert!(due(Vec3::new(0.03, 0.0, 0.1)).is_some());
    }

    #[test]
    fn the_plans_own_visits_count() {
        let mut drift = drift("[reference]\nat_mm = [0, 0, 90]\nevery_points = 2\n", 3600.0);
        let own = drift.visit;
        assert_eq!(own.kind, VisitKind::Reference);
        assert!(drift.measured(&own, &sample(5.0, 2.0)).is_some());
        assert!(!is_due(&drift, 900.0));
        let other = Visit { kind: VisitKind::Point, ..own };
        assert_eq!(drift.measured(&other, &sample(6.0, 9.0)), None);
    }
}
