//! The rows of a plan: runs of visits that a robot can scan in motion.

use std::ops::Range;

use fieldgap_acoustics::Vec3;
use fieldgap_records::{FEWEST_FLOWN, Visit, VisitKind, VisitPace};

/// Largest difference between steps of a row, m.
const SAME_STEP_M: f64 = 1e-9;

/// One leg of the scan, as indices of visits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Leg {
    /// One point, measured at standstill.
    Stop(usize),
    /// A row scanned at constant speed.
    Row(Range<usize>),
}

impl Leg {
    /// Indices of its visits.
    pub fn rows(&self) -> Range<usize> {
        match self {
            Self::Stop(visit) => *visit..visit + 1,
            Self::Row(row) => row.clone(),
        }
    }
}

/// The legs of the visits from `done` on, in order. Where the plan leaves the pace open all are stops, unless it flies (`in_motion`). A row
/// that a list has in motion is flown whole, although some of it may be done: fewer of it would be another motion.
pub(super) fn legs(visits: &[Visit], done: usize, in_motion: bool) -> Vec<Leg> {
    let mut legs = Vec::new();
    let mut at = row_begun(visits, done).unwrap_or(done);
    while at < visits.len() {
        let flies = match visits[at].pace {
            VisitPace::OfPlan => in_motion,
            VisitPace::AtRest => false,
            VisitPace::Flown(_) => true,
        };
        let length = if flies { row_length(&visits[at..]) } else { 1 };
        if length >= FEWEST_FLOWN {
            legs.push(Leg::Row(at..at + length));
            at += length;
        } else {
            legs.push(Leg::Stop(at));
            at += 1;
        }
    }
    legs
}

/// Where the row of a list begins that a visit belongs to, if the list has it in motion.
fn row_begun(visits: &[Visit], visit: usize) -> Option<usize> {
    let of = visits.get(visit).filter(|of| matches!(of.pace, VisitPace::Flown(_)))?;
    let same =
        |before: &&Visit| before.part == of.part && matches!(before.pace, VisitPace::Flown(_));
    let mut first = visit - visits[..visit].iter().rev().take_while(same).count();
    loop {
        let length = row_length(&visits[first..]);
        if first + length > visit {
            return Some(first);
        }
        first += length;
    }
}

/// How many of the first visits form one row.
fn row_length(visits: &[Visit]) -> usize {
    let in_row = |visit: &Visit| {
        visit.kind == VisitKind::Point
            && (visit.focus, visit.part, visit.pace)
                == (visits[0].focus, visits[0].part, visits[0].pace)
    };
    let Some(second) = visits.get(1) else { return 1 };
    let step_m = second.position_m - visits[0].position_m;
    if !in_row(&visits[0]) || !in_row(second) || step_m.norm() < SAME_STEP_M {
        return 1;
    }
    let follows = |pair: &&[Visit]| {
        in_row(&pair[1]) && (pair[1].position_m - pair[0].position_m - step_m).norm() < SAME_STEP_M
    };
    1 + visits.windows(2).take_while(follows).count()
}

/// The straight line of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// The first point, m, array frame.
    pub first_m: Vec3,
    /// The last point, m, array frame.
    pub last_m: Vec3,
    /// Number of points; two or more.
    pub points: usize,
}

impl Line {
    /// The line through the visits of a row.
    pub fn of(row: &[Visit]) -> Self {
        let (first, last) = (row[0].position_m, row[row.len() - 1].position_m);
        Self { first_m: first, last_m: last, points: row.len() }
    }

    /// The same line in the other direction.
    pub fn back(self) -> Self {
        Self { first_m: self.last_m, last_m: self.first_m, ..self }
    }

    /// Distance from point to point, m.
    pub fn step_m(&self) -> f64 {
        (self.last_m - self.first_m).norm() / (self.points - 1) as f64
    }

    /// Start and end of a pass over it, with a lead on either side, m.
    pub fn ends_m(&self, lead_m: f64) -> [Vec3; 2] {
        let lead_m = (self.last_m - self.first_m).normalize() * lead_m;
        [self.first_m - lead_m, self.last_m + lead_m]
    }

    /// Distance of a point from the line, m.
    pub fn distance_m(&self, point_m: Vec3) -> f64 {
        let along = self.last_m - self.first_m;
        let share = (point_m - self.first_m).dot(&along) / along.norm_squared();
        (self.first_m + along * share.clamp(0.0, 1.0) - point_m).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::TomlSource;
    use fieldgap_records::Plan;

    fn visits(regions: &str) -> Vec<Visit> {
        let text = format!(
            "name = \"t\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0\ny_mm = 0\nz_mm = 100\n{regions}"
        );
        Plan::parse(TomlSource::new(std::path::Path::new("plan.toml"), text))
            .expect("valid")
            .visits()
    }

    #[test]
    fn a_plane_is_scanned_row_by_row_and_single_points_at_standstill() {
        let visits = visits(
            "[dark]\nbefore = 2\n[reference]\nat_mm = [0, 0, 100]\nevery_points = 18\n\
             [[plane]]\nz_mm = 100\nsize_mm = [20, 10]\nstep_mm = 4\n\
             [[points]]\nat_mm = [[0, 0, 50], [1, 0, 50], [2, 0, 50]]\n",
        );
        // 6 columns and 3 rows, whose ends are joined by a step of the same length but another way.
        let found = legs(&visits, 0, true);
        let rows: Vec<&Leg> = found.iter().filter(|leg| matches!(leg, Leg::Row(_))).collect();
        assert_eq!(rows, [&Leg::Row(3..9), &Leg::Row(9..15), &Leg::Row(15..21)]);
        let stops = found.iter().filter(|leg| matches!(leg, Leg::Stop(_))).count();
        assert_eq!(stops, visits.len() - 18);
        assert_eq!(legs(&visits, 0, false).len(), visits.len());
    }

    #[test]
    fn the_rest_of_a_row_is_a_shorter_row() {
        let visits = visits("[[line]]\nfrom_mm = [0, 0, 50]\nto_mm = [0, 0, 59]\nstep_mm = 1\n");
        assert_eq!(legs(&visits, 4, true), [Leg::Row(4..10)]);
        assert_eq!(legs(&visits, 7, true), [Leg::Stop(7), Leg::Stop(8), Leg::Stop(9)]);
    }

    /// Two rows that a list has in motion, beside readings at rest that would form one.
    #[test]
    fn a_listed_row_is_flown_whole_wherever_a_scan_goes_on() {
        let listed = |paces: &str| {
            visits(&format!(
                "[[readings]]\nat_mm = [[0, 0, 50], [1, 0, 50], [2, 0, 50], [3, 0, 50], [4, 0, 50], [4, 1, 50], [4, 2, 50], [4, 3, 50],\
                 [5, 3, 50], [6, 3, 50], [7, 3, 50], [8, 3, 50]]\nfocus = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n{paces}"
            ))
        };
        let visits = listed("speed_mm_s = [9, 9, 9, 9, 60, 60, 60, 60, 0, 0, 0, 0]\n");
        let rest = |from: usize| (from..12).map(Leg::Stop).collect::<Vec<_>>();
        for in_motion in [true, false] {
            let from = |done: usize| legs(&visits, done, in_motion);
            assert_eq!(from(0)[..3], [Leg::Row(0..4), Leg::Row(4..8), Leg::Stop(8)]);
            assert_eq!(from(2), from(0));
            assert_eq!(from(4), from(0)[1..]);
            assert_eq!(from(7), from(0)[1..]);
            assert_eq!(from(8), rest(8));
            assert_eq!(from(12), []);
        }
        // Without speeds the section `[fly]` decides.
        assert_eq!(legs(&listed(""), 0, false).len(), 12);
        assert_eq!(legs(&listed(""), 0, true)[0], Leg::Row(0..5));
    }

    #[test]
    fn a_pass_starts_before_the_first_point_and_ends_after_the_last() {
        let line = Line {
            first_m: Vec3::new(0.01, 0.0, 0.1),
            last_m: Vec3::new(-0.01, 0.0, 0.1),
            points: 11,
        };
        let [from_m, to_m] = line.ends_m(5e-3);
        assert!((from_m.x - 0.015).abs() < 1e-15 && (to_m.x + 0.015).abs() < 1e-15);
        assert!((line.step_m() - 2e-3).abs() < 1e-15);
        assert!((line.distance_m(Vec3::new(0.02, 0.0, 0.1)) - 0.01).abs() < 1e-15);
        assert!((line.distance_m(Vec3::new(0.0, 0.03, 0.1)) - 0.03).abs() < 1e-15);
    }
}
