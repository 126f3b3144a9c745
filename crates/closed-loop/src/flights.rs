//! Rows of readings taken in motion: where they may lie, how fast they are flown, and what they cost.
//!
//! A lag of the readings behind the robot shows in motion alone, and grows with speed; play shows in the direction alone. So a row may be
//! flown at two speeds, along two axes and either way.

use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::{RigSetup, lead_m, pass_s};
use fieldgap_diagnosis::PossibleReading;
use fieldgap_input::Speed;
use fieldgap_records::{BoxMm, FEWEST_FLOWN, Plan};

use crate::places::rounded_m;
use crate::robot::{Planned, Robot};

/// Readings of a row. Set by judgement: with more, a round has few rows; with fewer, most of the time goes into leads.
pub(crate) const ROW: usize = 8;

/// The slower speed as a share of that of `[fly]`: a lag is told from play by the difference of both. Set by judgement.
const SLOWER: f64 = 1.0 / 3.0;

/// From reading to reading, in wavelengths: the windows over which readings are averaged then touch, and share no noise.
const STEP_OF_WAVELENGTH: f64 = 0.25;

/// How a rig flies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Flying {
    /// Each speed with its lead, m.
    speeds: [(Speed, f64); 2],
    /// From reading to reading, mm.
    step_mm: f64,
}

/// A row that is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    first_mm: Vec3,
    step_mm: Vec3,
    count: usize,
    pub focus: usize,
    pub speed_mm_s: Speed,
    lead_m: f64,
}

impl Flying {
    /// The flights of a plan; `None` without `[fly]`.
    pub fn of(plan: &Plan, rig_setup: &RigSetup) -> Option<Self> {
        let fly = plan.fly.as_ref()?;
        let slower = Speed::new(tenths(SLOWER * fly.speed_mm_s.get())).unwrap_or(fly.speed_mm_s);
        let wavelength_mm =
            1e3 * rig_setup.nominal_medium().speed_of_sound_m_s / rig_setup.array.frequency_hz();
        Some(Self {
            speeds: [fly.speed_mm_s, slower].map(|speed| (speed, lead_m(Some(fly), speed))),
            step_mm: (100.0 * STEP_OF_WAVELENGTH * wavelength_mm).ceil() / 100.0,
        })
    }

    /// A row about a place in a box. The `variant` says in which way it is flown: its lowest digits in base two are speed, direction and
    /// axis. `None` if too few readings fit into the box, or if the robot does not reach its ends.
    pub fn row(
        &self,
        about_m: Vec3,
        focus: usize,
        variant: usize,
        within: &BoxMm,
        robot: &Robot,
    ) -> Option<Row> {
        let digit = |n: usize| variant >> n & 1;
        let (speed_mm_s, lead_m) = self.speeds[digit(0)];
        let axis = digit(2);
        let count = (((within.most - within.least)[axis] / self.step_mm) as usize + 1).min(ROW);
        if count < FEWEST_FLOWN {
            return None;
        }
        let length_mm = self.step_mm * (count - 1) as f64;
        let middle_mm = about_m * 1e3;
        let mut low_mm = middle_mm;
        low_mm[axis] = (middle_mm[axis] - 0.5 * length_mm)
            .clamp(within.least[axis], within.most[axis] - length_mm);
        let low_mm = rounded_m(low_mm) * 1e3;
        let along = Vec3::ith(axis, 1.0);
        let (first_mm, step_mm) = match digit(1) {
            0 => (low_mm, along * self.step_mm),
            _ => (low_mm + along * length_mm, -along * self.step_mm),
        };
        let row = Row { first_mm, step_mm, count, focus, speed_mm_s, lead_m };
        let [begins_m, ends_m] = row.ends_m();
        let flies = [begins_m, ends_m].iter().all(|end_m| robot.reaches(*end_m))
            && robot.is_free(begins_m, ends_m);
        flies.then_some(row)
    }
}

impl Row {
    /// Its places, m.
    pub fn places_m(&self) -> impl Iterator<Item = Vec3> {
        let Self { first_mm, step_mm, count, .. } = *self;
        (0..count).map(move |n| rounded_m(first_mm + step_mm * n as f64))
    }

    /// Its readings.
    pub fn readings(&self) -> impl Iterator<Item = Planned> {
        let focus = self.focus;
        self.places_m().map(move |at_m| (at_m, Some(focus)))
    }

    /// What it could read; `from_below`: whether the robot comes to it from smaller x, where it is not flown along x.
    pub fn possible(&self, from_below: bool) -> impl Iterator<Item = PossibleReading> {
        let velocity_m_s = self.step_mm.normalize() * (self.speed_mm_s.get() * 1e-3);
        let from_below = if self.step_mm.x == 0.0 { from_below } else { self.step_mm.x > 0.0 };
        let focus = self.focus;
        self.places_m().map(move |at_m| PossibleReading { at_m, focus, from_below, velocity_m_s })
    }

    /// Its middle, m.
    pub fn middle_m(&self) -> Vec3 {
        (self.first_mm + self.step_mm * (0.5 * (self.count - 1) as f64)) * 1e-3
    }

    /// Number of its readings.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Where the robot begins and ends to fly it, with its leads, m.
    pub fn ends_m(&self) -> [Vec3; 2] {
        let lead_mm = self.step_mm.normalize() * self.lead_m * 1e3;
        let last_mm = self.first_mm + self.step_mm * (self.count - 1) as f64;
        [(self.first_mm - lead_mm) * 1e-3, (last_mm + lead_mm) * 1e-3]
    }

    /// Time of the pass, s.
    pub fn pass_s(&self) -> f64 {
        let [begins_m, ends_m] = self.ends_m();
        pass_s((ends_m - begins_m).norm(), self.speed_mm_s.get() * 1e-3)
    }

    /// Whether a record would show that the robot comes to a place from the other side than it does: it flies past the last reading of the
    /// row, and turns.
    fn hides_the_turn_to(&self, next_m: Vec3) -> bool {
        let [_, ends_m] = self.ends_m();
        let last_m = (self.first_mm + self.step_mm * (self.count - 1) as f64) * 1e-3;
        (next_m.x - last_m.x) * (ends_m.x - next_m.x) > 0.0
    }
}

/// Readings at rest with rows that are flown between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Course {
    /// All readings in their order.
    pub readings: Vec<Planned>,
    /// The rows, each with the number of its first reading.
    pub rows: Vec<(usize, Row)>,
}

impl Course {
    /// Of readings at rest alone.
    pub fn at_rest(readings: Vec<Planned>) -> Self {
        Self { readings, rows: Vec::new() }
    }

    /// Readings at rest from a place on, in their order, with each row where it makes the shortest detour. A row that no free way reaches is
    /// left out. The last reading is at rest, so that the robot stands there.
    pub fn with_rows(from_m: Vec3, at_rest: &[Planned], rows: &[Row], robot: &Robot) -> Self {
        // The rows before each reading at rest, in their order.
        let mut before: Vec<Vec<Row>> = vec![Vec::new(); at_rest.len()];
        for row in rows {
            let mut best: Option<(f64, usize, usize)> = None;
            for (gap, others) in before.iter().enumerate() {
                for place in 0..=others.len() {
                    let stands_m = if gap == 0 { from_m } else { at_rest[gap - 1].0 };
                    let previous = place.checked_sub(1).map(|place| &others[place]);
                    let next = others.get(place);
                    let detour_s = detour_s(stands_m, previous, row, next, at_rest[gap].0, robot);
                    if let Some(detour_s) =
                        detour_s.filter(|detour_s| best.is_none_or(|best| *detour_s < best.0))
                    {
                        best = Some((detour_s, gap, place));
                    }
                }
            }
            if let Some((_, gap, place)) = best {
                before[gap].insert(place, *row);
            }
        }
        let mut course = Self::default();
        for (reading, rows) in at_rest.iter().zip(before) {
            for row in rows {
                course.rows.push((course.readings.len(), row));
                course.readings.extend(row.readings());
            }
            course.readings.push(*reading);
        }
        course
    }

    /// The same after silent readings.
    pub fn after(mut self, silent: impl ExactSizeIterator<Item = Planned>) -> Self {
        self.rows.iter_mut().for_each(|(first, _)| *first += silent.len());
        self.readings.splice(0..0, silent);
        self
    }

    /// The row that a reading belongs to.
    fn row_of(&self, reading: usize) -> Option<&(usize, Row)> {
        self.rows.iter().find(|(first, row)| (*first..first + row.len()).contains(&reading))
    }

    /// Speed of each reading, mm/s, zero at rest; `None` if all are at rest.
    pub fn speeds_mm_s(&self) -> Option<Vec<f64>> {
        let speed = |n| self.row_of(n).map_or(0.0, |(_, row)| row.speed_mm_s.get());
        (!self.rows.is_empty()).then(|| (0..self.readings.len()).map(speed).collect())
    }

    /// Time that it takes from a place on, s.
    pub fn duration_s(&self, from_m: Vec3, robot: &Robot) -> f64 {
        let (mut at_m, mut took_s) = (from_m, 0.0);
        let mut n = 0;
        while n < self.readings.len() {
            match self.row_of(n) {
                Some((_, row)) => {
                    let [begins_m, ends_m] = row.ends_m();
                    took_s += robot.move_s(at_m, begins_m) + row.pass_s();
                    at_m = ends_m;
                    n += row.len();
                }
                None => {
                    let to_m = self.readings[n].0;
                    took_s += robot.move_s(at_m, to_m) + robot.reading_s();
                    at_m = to_m;
                    n += 1;
                }
            }
        }
        took_s
    }
}

/// Time of the detour over a row, s, from a place or the row before it to the row after it or a place; `None` if it is not free, or if the
/// record would show the next place to be approached from the other side.
fn detour_s(
    stands_m: Vec3,
    previous: Option<&Row>,
    row: &Row,
    next: Option<&Row>,
    next_m: Vec3,
    robot: &Robot,
) -> Option<f64> {
    let from_m = previous.map_or(stands_m, |previous| previous.ends_m()[1]);
    let to_m = next.map_or(next_m, |next| next.ends_m()[0]);
    // A row along x has a direction of its own.
    let along_x = |row: &Row| row.step_mm.x != 0.0;
    let hidden = |row: &Row, next: Option<&Row>, next_m: Vec3| match next {
        Some(next) => !along_x(next) && row.hides_the_turn_to(next.first_mm * 1e-3),
        None => row.hides_the_turn_to(next_m),
    };
    if hidden(row, next, next_m)
        || previous.is_some_and(|previous| hidden(previous, Some(row), next_m))
    {
        return None;
    }
    let [begins_m, ends_m] = row.ends_m();
    let is_free = robot.is_free(from_m, begins_m) && robot.is_free(ends_m, to_m);
    let longer_s =
        robot.move_s(from_m, begins_m) + robot.move_s(ends_m, to_m) - robot.move_s(from_m, to_m);
    is_free.then_some(longer_s)
}

/// A speed rounded to a tenth of a millimetre a second, mm/s: plans are read by people.
fn tenths(mm_s: f64) -> f64 {
    (10.0 * mm_s).round() / 10.0
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_input::{TomlSource, literal};

    use super::*;

    fn rig_setup(more: &str) -> RigSetup {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
        let text = std::fs::read_to_string(&path).expect("the rig file");
        let text = text.replace("[motion.marlin]", &format!("{more}\n[motion.marlin]"));
        RigSetup::parse(TomlSource::new(&path, text)).expect("a rig file")
    }

    fn flying() -> Flying {
        Flying { speeds: [(literal(180.0), 20e-3), (literal(60.0), 3e-3)], step_mm: 2.15 }
    }

    const BOX: BoxMm =
        BoxMm { least: Vec3::new(-30.0, -30.0, 60.0), most: Vec3::new(30.0, 30.0, 140.0) };

    #[test]
    fn a_row_lies_within_its_box_and_its_leads_within_reach() {
        let robot = Robot::of(&rig_setup(""));
        for variant in 0..8 {
            let about_m = Vec3::new(0.029, -0.0291, 0.1);
            let row = flying().row(about_m, 0, variant, &BOX, &robot).expect("it is free");
            let places_m: Vec<Vec3> = row.places_m().collect();
            assert_eq!(places_m.len(), ROW);
            let inside = |at_m: &Vec3| at_m.x.abs().max(at_m.y.abs()) <= 0.03 + 1e-12;
            assert!(places_m.iter().all(inside), "{places_m:?}");
            let steps = places_m.windows(2).map(|pair| pair[1] - pair[0]);
            assert!(steps.clone().all(|step| (step.norm() - 2.15e-3).abs() < 1e-12));
            let [begins_m, ends_m] = row.ends_m();
            let speed = row.speed_mm_s.get();
            assert_eq!(speed, if variant & 1 == 0 { 180.0 } else { 60.0 });
            let lead_m = if variant & 1 == 0 { 20e-3 } else { 3e-3 };
            assert!(((begins_m - places_m[0]).norm() - lead_m).abs() < 1e-12);
            assert!(((ends_m - places_m[ROW - 1]).norm() - lead_m).abs() < 1e-12);
            assert_eq!(row.readings().count(), ROW);
            for one in row.possible(true) {
                let along = (places_m[1] - places_m[0]).normalize();
                assert!((one.velocity_m_s - along * speed * 1e-3).norm() < 1e-12);
                assert_eq!(one.from_below, along.x >= 0.0);
            }
        }
        // A box too small for a row, and a post where the lead of the faster row would be.
        let narrow = BoxMm { most: Vec3::new(-24.0, 30.0, 140.0), ..BOX };
        assert!(flying().row(Vec3::new(-0.027, 0.0, 0.1), 0, 0, &narrow, &robot).is_none());
        let post = "[[motion.keep_out]]\nname = \"post\"\nmin_mm = [185, 140, 70]\nmax_mm = [190, 160, 130]";
        let robot = Robot::of(&rig_setup(post));
        let row = |variant| flying().row(Vec3::new(0.02, 0.0, 0.12), 0, variant, &BOX, &robot);
        assert!(row(0).is_none() && row(1).is_some());
    }

    #[test]
    fn rows_are_flown_where_the_detour_is_short_and_the_time_counts_leads_and_passes() {
        let robot = Robot::of(&rig_setup(""));
        let at = |x: f64| (Vec3::new(x, 0.0, 0.1), Some(0));
        let at_rest = [at(-0.03), at(-0.025), at(0.025), at(0.029)];
        let row = flying().row(Vec3::new(0.0, 0.0, 0.1), 1, 1, &BOX, &robot).expect("free");
        let from_m = Vec3::new(-0.03, 0.01, 0.1);
        let course = Course::with_rows(from_m, &at_rest, &[row], &robot);
        assert_eq!(course.rows, [(2, row)]);
        let speeds = course.speeds_mm_s().expect("some are flown");
        assert_eq!(speeds[..3], [0.0, 0.0, 60.0]);
        assert_eq!(speeds[2 + ROW..], [0.0, 0.0]);
        let [begins_m, ends_m] = row.ends_m();
        let moves_s = [
            (from_m, at(-0.03).0),
            (at(-0.03).0, at(-0.025).0),
            (at(-0.025).0, begins_m),
            (ends_m, at(0.025).0),
            (at(0.025).0, at(0.029).0),
        ];
        let moves_s: f64 = moves_s.iter().map(|(a, b)| robot.move_s(*a, *b)).sum();
        let expected_s = moves_s + 4.0 * robot.reading_s() + row.pass_s();
        assert!((course.duration_s(from_m, &robot) - expected_s).abs() < 1e-9);
        // Silent readings before move the rows.
        let later = course.after(std::iter::repeat_n((from_m, None), 3));
        assert_eq!((later.rows[0].0, later.readings.len()), (5, 3 + 4 + ROW));
    }

    /// The robot ends 20 mm past a row and comes back to a place 5 mm past it, while the record shows it go on in the same direction.
    #[test]
    fn no_reading_follows_a_row_where_the_record_would_hide_the_turn() {
        let robot = Robot::of(&rig_setup(""));
        let row = flying().row(Vec3::new(-0.01, 0.0, 0.1), 0, 0, &BOX, &robot).expect("free");
        let last_m = row.places_m().last().expect("some");
        let at = |past_m: f64| (last_m + Vec3::new(past_m, 0.001, 0.0), Some(0));
        let from_m = Vec3::new(-0.03, 0.0, 0.1);
        assert!(Course::with_rows(from_m, &[at(0.005)], &[row], &robot).rows.is_empty());
        for past_m in [-0.005, 0.025] {
            assert_eq!(Course::with_rows(from_m, &[at(past_m)], &[row], &robot).rows.len(), 1);
        }
    }
}
