//! The robot's motion before each reading, from the recorded places and times.
//!
//! A row is a run of readings along a line. Within it the way of the robot is known. How it came to the first reading of a row, or to a
//! reading outside of any row, the record does not say. Either it made a run-up or stood still, so that a first reading has the motion of its
//! row and a single reading has none; or it came straight from the reading before, at an even pace. Which of these holds is the same for a
//! whole scan, and its readings decide. They also decide from which side the robot came to the first place of a record.

use fieldgap_acoustics::Vec3;

use crate::statistics::median::median;

/// Cosine of the angle between neighbouring steps of a row at least: they may deviate by 14 degrees, as with places that are off by a tenth of
/// a step.
const STRAIGHT: f64 = 0.97;

/// Ratio of the speeds of neighbouring steps of a row at most. The first two steps after a start from rest differ by three, at even times
/// and constant acceleration.
const OF_SPEEDS: f64 = 4.0;

/// Steps of a row at least: two or three readings stand in a line by chance.
const FEWEST_STEPS: usize = 3;

/// Share of the usual step by which a recorded place may be off: a move along x of less does not turn its direction, and a row whose places
/// are off by less from those at a constant velocity has that velocity. (Differences of neighbours would average the errors of the places
/// wherever a lag is fitted, which speaks for a lag.)
const OFF: f64 = 0.1;

/// Move along x that turns its direction in any case, m: robots report places to some hundredths of a millimetre. Between single readings the
/// usual step is tens of millimetres, and shorter moves take up play as well.
const A_MOVE_M: f64 = 0.1e-3;

/// Moments before a reading at which the place is kept, and the least time from one to the next, s: about the lags of receivers and
/// averages.
const MOMENTS: usize = 4;
const LEAST_STEP_S: f64 = 0.015;

/// How the robot moved before a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    /// The last direction of travel along x: 1, -1, or 0 before it moved.
    pub x_direction: f64,
    /// How far it went along x since it turned to that direction, m; infinite after a run-up.
    pub x_since_m: f64,
    /// Time from one moment to the next, s.
    step_s: f64,
    /// From the place of the reading to the places one moment and more before it, m.
    back_m: [Vec3; MOMENTS],
}

impl Motion {
    /// At a constant velocity, m/s.
    pub fn steady(velocity_m_s: Vec3, x_direction: f64) -> Self {
        let back_m = std::array::from_fn(|n| -velocity_m_s * (n + 1) as f64);
        Self { x_direction, x_since_m: f64::INFINITY, step_s: 1.0, back_m }
    }

    /// The same after so far along x since a turn, m.
    pub fn since_turn(self, x_since_m: f64) -> Self {
        Self { x_since_m, ..self }
    }

    /// From the place of the reading to the place at a time before it, m.
    pub fn back_m(&self, before_s: f64) -> Vec3 {
        let steps = before_s / self.step_s;
        let after = (steps as usize).min(MOMENTS - 1);
        let from_m = if after == 0 { Vec3::zeros() } else { self.back_m[after - 1] };
        from_m + (self.back_m[after] - from_m) * (steps - after as f64)
    }

    /// Mean velocity just before the reading, m/s.
    pub fn velocity_m_s(&self) -> Vec3 {
        -self.back_m[0] / self.step_s
    }
}

/// The motion before a reading, and another that is possible where the robot's way to it is not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Approach {
    /// Within a row the motion; elsewhere that after a run-up or at rest.
    pub motion: Motion,
    /// Outside of a row: straight from the reading before, or from above along x where the record begins.
    pub otherwise: Option<Motion>,
    /// Whether it is a reading of the first place of a record along x, to which the robot came from below or from above.
    pub begins: bool,
}

/// The approach to each reading, from its time, s, and place, m.
pub(crate) fn approaches(readings: &[(f64, Vec3)]) -> Vec<Approach> {
    let ways = Ways::of(readings);
    let mut x = Direction { usual_m: ways.usual_m, ..Direction::default() };
    let mut approaches: Vec<Approach> = (0..readings.len())
        .map(|reading| {
            x.follow(readings[reading].1.x);
            let came = (x.now, x.since_m);
            // The steps of a row may be far below the usual one of other readings.
            let velocity_m_s = ways.steady_m_s[reading].unwrap_or_default();
            if velocity_m_s.x.abs() > OFF * velocity_m_s.norm() {
                x.run_up(velocity_m_s.x.signum(), readings[reading].1.x);
            }
            let motion = ways.motion(reading, &x);
            if ways.in_row[reading] {
                return Approach { motion, otherwise: None, begins: false };
            }
            let velocity_m_s = match reading {
                0 => Vec3::zeros(),
                _ => ways.steps[reading - 1].velocity_m_s(),
            };
            let otherwise = Motion::steady(velocity_m_s, came.0).since_turn(came.1);
            let along_m = ways.row_from(reading).map_or(0.0, |row| ways.steps[row].moved_m.x);
            let motion = match x.is_a_move(along_m) {
                true => {
                    Motion { x_direction: along_m.signum(), x_since_m: f64::INFINITY, ..motion }
                }
                false => motion,
            };
            Approach { motion, otherwise: Some(otherwise), begins: false }
        })
        .collect();
    if x.now != 0.0 {
        approaches.iter_mut().for_each(Approach::begin_from_either_side);
    }
    approaches
}

impl Approach {
    /// A robot that moves along x in a record came to its first place from one side.
    fn begin_from_either_side(&mut self) {
        let Self { motion, otherwise: Some(otherwise), begins } = self else { return };
        if motion.x_direction == 0.0 {
            (motion.x_direction, motion.x_since_m) = (1.0, f64::INFINITY);
            (otherwise.x_direction, otherwise.x_since_m) = (-1.0, f64::INFINITY);
            *begins = true;
        }
    }
}

/// From one reading to the next.
#[derive(Debug, Clone, Copy)]
struct Step {
    moved_m: Vec3,
    took_s: f64,
}

impl Step {
    fn stands(&self) -> bool {
        self.moved_m == Vec3::zeros()
    }

    /// Mean velocity; zero where the record has no times.
    fn velocity_m_s(&self) -> Vec3 {
        if self.took_s > 0.0 { self.moved_m / self.took_s } else { Vec3::zeros() }
    }

    /// Whether the next move may belong to the same row.
    fn is_continued_by(&self, next: &Self) -> bool {
        let [before, after] = [self, next].map(|step| step.moved_m.norm());
        let [slow, fast] = [self, next].map(|step| step.velocity_m_s().norm());
        self.moved_m.dot(&next.moved_m) > STRAIGHT * before * after
            && slow.max(fast) <= OF_SPEEDS * slow.min(fast)
    }
}

/// The steps of a scan and which of them belong to rows.
struct Ways<'r> {
    readings: &'r [(f64, Vec3)],
    steps: Vec<Step>,
    /// Whether the step to each reading belongs to a row.
    in_row: Vec<bool>,
    /// The velocity of the row of each reading, if it is constant, m/s; the first reading of a row included.
    steady_m_s: Vec<Option<Vec3>>,
    /// Median step, m.
    usual_m: f64,
}

impl<'r> Ways<'r> {
    fn of(readings: &'r [(f64, Vec3)]) -> Self {
        let step = |pair: &[(f64, Vec3)]| Step {
            moved_m: pair[1].1 - pair[0].1,
            took_s: pair[1].0 - pair[0].0,
        };
        let steps: Vec<Step> = readings.windows(2).map(step).collect();
        let mut in_row = vec![false; readings.len()];
        // Between the readings of several drives at one place the robot stands, and its row goes on.
        let moves: Vec<usize> = (0..steps.len()).filter(|&n| !steps[n].stands()).collect();
        let joined = |a: &usize, b: &usize| steps[*a].is_continued_by(&steps[*b]);
        let usual_m = median(moves.iter().map(|&n| steps[n].moved_m.norm()).collect());
        let mut steady_m_s = vec![None; readings.len()];
        for row in moves.chunk_by(joined).filter(|row| row.len() >= FEWEST_STEPS) {
            let (first, last) = (row[0], row[row.len() - 1] + 1);
            let velocity_m_s = constant_velocity_m_s(&readings[first..=last], usual_m);
            // Where one row goes over into another, their common reading has the velocity of the one before.
            let from = if in_row[first] { first + 1 } else { first };
            steady_m_s[from..=last].fill(velocity_m_s);
            in_row[first + 1..=last].fill(true);
        }
        Self { readings, steps, in_row, steady_m_s, usual_m }
    }

    /// The first step of the row that begins with a reading.
    fn row_from(&self, reading: usize) -> Option<usize> {
        self.in_row.get(reading + 1).copied().unwrap_or(false).then_some(reading)
    }

    /// The velocity before the first reading of a row: none if the row begins slowly, and so from rest.
    fn first_velocity_m_s(&self, reading: usize) -> Vec3 {
        let Some(first) = self.row_from(reading) else { return Vec3::zeros() };
        let one = self.steps[first];
        let velocity_m_s = one.velocity_m_s();
        let two = self.steps.get(first + 1).copied().unwrap_or(one);
        let slower_m = (two.velocity_m_s().norm() - velocity_m_s.norm()) * one.took_s;
        if two.stands() || slower_m > OFF * self.usual_m { Vec3::zeros() } else { velocity_m_s }
    }

    fn is_timed_in_row(&self, reading: usize) -> bool {
        self.in_row[reading] && self.steps[reading - 1].took_s > 0.0
    }

    /// The motion before a reading along its row, and before the row as at its first reading.
    fn motion(&self, reading: usize, x: &Direction) -> Motion {
        let (x_direction, x_since_m) = (x.now, x.since_m);
        if let Some(velocity_m_s) = self.steady_m_s[reading] {
            return Motion::steady(velocity_m_s, x_direction).since_turn(x_since_m);
        }
        let (now_s, at_m) = self.readings[reading];
        let took_s = if self.in_row[reading] { self.steps[reading - 1].took_s } else { 0.0 };
        let step_s = took_s.max(LEAST_STEP_S);
        let mut earlier = reading;
        let back_m = std::array::from_fn(|n| {
            let then_s = now_s - step_s * (n + 1) as f64;
            while self.readings[earlier].0 > then_s && self.is_timed_in_row(earlier) {
                earlier -= 1;
            }
            let (known_s, known_m) = self.readings[earlier];
            let velocity_m_s = match known_s > then_s {
                true => self.first_velocity_m_s(earlier),
                false => self.steps[earlier].velocity_m_s(),
            };
            known_m + velocity_m_s * (then_s - known_s) - at_m
        });
        Motion { x_direction, x_since_m, step_s, back_m }
    }
}

/// The velocity with which all readings of a row agree, if there is one: the least-squares line through places over times.
fn constant_velocity_m_s(row: &[(f64, Vec3)], usual_m: f64) -> Option<Vec3> {
    let count = row.len() as f64;
    let middle_s = row.iter().map(|(time_s, _)| time_s).sum::<f64>() / count;
    let middle_m = row.iter().map(|(_, at_m)| at_m).sum::<Vec3>() / count;
    let (mut product, mut square) = (Vec3::zeros(), 0.0);
    for (time_s, at_m) in row {
        product += (at_m - middle_m) * (time_s - middle_s);
        square += (time_s - middle_s).powi(2);
    }
    let velocity_m_s = if square > 0.0 { product / square } else { Vec3::zeros() };
    let off_m = |(time_s, at_m): &(f64, Vec3)| {
        (at_m - middle_m - velocity_m_s * (time_s - middle_s)).norm()
    };
    (square > 0.0 && row.iter().map(off_m).fold(0.0, f64::max) <= OFF * usual_m)
        .then_some(velocity_m_s)
}

/// The direction of travel along x, which small moves do not turn.
#[derive(Debug, Default)]
struct Direction {
    usual_m: f64,
    now: f64,
    /// How far it went in this direction since it turned, m.
    since_m: f64,
    /// The farthest place in this direction, m.
    farthest_m: Option<f64>,
}

impl Direction {
    fn is_a_move(&self, moved_m: f64) -> bool {
        moved_m != 0.0 && moved_m.abs() > (OFF * self.usual_m).min(A_MOVE_M)
    }

    fn follow(&mut self, x_m: f64) {
        let farthest_m = *self.farthest_m.get_or_insert(x_m);
        let moved_m = x_m - farthest_m;
        if self.is_a_move(moved_m) && self.now != moved_m.signum() {
            (self.now, self.since_m) = (moved_m.signum(), 0.0);
        }
        if self.now * moved_m > 0.0 {
            self.farthest_m = Some(x_m);
            self.since_m += moved_m.abs();
        }
    }

    /// It came to this place by a run-up.
    fn run_up(&mut self, now: f64, x_m: f64) {
        (self.now, self.since_m, self.farthest_m) = (now, f64::INFINITY, Some(x_m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns along a row and rows of it.
    const SIDE: usize = 8;
    const STEP_M: f64 = 1e-3;

    fn at(x_m: f64, y_m: f64) -> Vec3 {
        Vec3::new(x_m, y_m, 0.1)
    }

    /// Rows at a speed, m/s, with this time from the last reading of a row to the first of the next.
    fn plane(serpentine: bool, speed_m_s: f64, turn_s: f64) -> Vec<(f64, Vec3)> {
        let mut time_s = 3.0;
        let mut readings = Vec::new();
        for row in 0..SIDE {
            for n in 0..SIDE {
                let back = serpentine && row % 2 == 1;
                let column = if back { SIDE - 1 - n } else { n };
                readings.push((time_s, at(column as f64 * STEP_M, row as f64 * STEP_M)));
                time_s += if n + 1 < SIDE { STEP_M / speed_m_s } else { turn_s };
            }
        }
        readings
    }

    fn assert_near(a: Vec3, b: Vec3) {
        assert!((a - b).norm() < 1e-9, "{a:?} is not {b:?}");
    }

    #[test]
    fn every_reading_of_a_flown_row_has_the_velocity_of_its_row() {
        for (serpentine, speed_m_s, turn_s) in
            [(true, 0.05, 0.7), (false, 0.05, 0.4), (true, 0.18, 0.5)]
        {
            let readings = plane(serpentine, speed_m_s, turn_s);
            for (n, approach) in approaches(&readings).into_iter().enumerate() {
                let back = serpentine && (n / SIDE) % 2 == 1;
                let direction = if back { -1.0 } else { 1.0 };
                let motion = approach.motion;
                assert_near(motion.velocity_m_s(), Vec3::x() * direction * speed_m_s);
                assert_eq!(motion.x_direction, direction, "reading {n}");
                for lag_s in [0.003, 0.03, 0.2] {
                    assert_near(motion.back_m(lag_s), -Vec3::x() * direction * speed_m_s * lag_s);
                }
                assert_eq!(approach.otherwise.is_some(), n % SIDE == 0);
            }
        }
    }

    #[test]
    fn the_first_reading_of_a_row_may_have_been_reached_straight_from_the_one_before() {
        let readings = plane(true, 0.02, 0.05);
        let otherwise = approaches(&readings)[SIDE].otherwise.expect("not in a row");
        assert_near(otherwise.velocity_m_s(), Vec3::y() * 0.02);
        assert_eq!(otherwise.x_direction, 1.0);
        let raster = approaches(&plane(false, 0.02, 0.35))[SIDE].otherwise.expect("not in a row");
        assert_near(raster.velocity_m_s(), Vec3::new(-0.02, STEP_M / 0.35, 0.0));
        assert_eq!(raster.x_direction, -1.0);
    }

    #[test]
    fn rows_along_y_of_places_that_are_off_have_no_direction_along_x_of_their_own() {
        let off_m = |n: usize| 4e-5 * ((7 * n) as f64).sin();
        let readings: Vec<(f64, Vec3)> = plane(true, 0.05, 0.6)
            .into_iter()
            .enumerate()
            .map(|(n, (time_s, at_m))| (time_s, at(at_m.y + off_m(n), at_m.x + off_m(n + 3))))
            .collect();
        for (n, approach) in approaches(&readings).iter().enumerate().skip(SIDE) {
            assert_eq!(approach.motion.x_direction, 1.0, "reading {n}");
            assert_eq!(approach.otherwise.is_some(), n % SIDE == 0, "reading {n}");
        }
    }

    #[test]
    fn a_pause_within_a_row_and_uneven_times_leave_its_velocity() {
        let mut readings = plane(true, 0.05, 0.7);
        readings.iter_mut().skip(SIDE + 3).for_each(|(time_s, _)| *time_s += 30.0);
        let paused = approaches(&readings);
        assert_near(paused[SIDE + 3].motion.velocity_m_s(), -Vec3::x() * 0.05);
        assert!(paused[SIDE + 3].otherwise.is_some());
        // Read at uneven places, all at one speed.
        let uneven: Vec<(f64, Vec3)> = (0..20)
            .map(|n| 0.02 * f64::from(n) + 0.004 * f64::from(n % 3))
            .map(|time_s| (time_s, at(0.05 * time_s, 0.0)))
            .collect();
        for approach in approaches(&uneven) {
            assert_near(approach.motion.back_m(0.03), -Vec3::x() * 0.05 * 0.03);
        }
    }

    /// Constant acceleration from rest, the ramp among the readings: the place a moment ago, and rest before the start.
    #[test]
    fn on_a_ramp_the_place_a_moment_ago_is_that_of_the_record() {
        const ACCELERATION: f64 = 1.0;
        let place_m = |time_s: f64| {
            let (ramp_s, time_s) = (0.1, f64::max(time_s, 0.0));
            let on_ramp = 0.5 * ACCELERATION * time_s.min(ramp_s).powi(2);
            on_ramp + ACCELERATION * ramp_s * (time_s - ramp_s).max(0.0)
        };
        let times = (0..15).map(|n| 0.02 * f64::from(n));
        let readings: Vec<(f64, Vec3)> = times.map(|t_s| (t_s, at(place_m(t_s), 0.0))).collect();
        for ((time_s, at_m), approach) in readings.iter().zip(approaches(&readings)) {
            for lag_s in [0.01, 0.03, 0.06] {
                let truly_m = at(place_m(time_s - lag_s), 0.0);
                let found_m = at_m + approach.motion.back_m(lag_s);
                assert!((found_m - truly_m).norm() < 1e-4, "{time_s} {lag_s}");
            }
        }
    }

    /// The steps of a row are far below those between single readings, which turn no direction.
    #[test]
    fn a_row_among_single_readings_has_its_own_direction() {
        let mut readings = vec![(0.0, at(0.0, 0.0)), (1.0, at(0.05, 0.03)), (2.0, at(0.1, -0.02))];
        readings.extend(
            (0..6).map(|n| (3.0 + 0.04 * f64::from(n), at(0.11 - 0.002 * f64::from(n), 0.0))),
        );
        readings.extend([(5.0, at(0.15, 0.0)), (6.0, at(0.19, 0.03)), (7.0, at(0.23, 0.0))]);
        let motions: Vec<Motion> =
            approaches(&readings).iter().map(|approach| approach.motion).collect();
        let directions: Vec<f64> = motions.iter().map(|motion| motion.x_direction).collect();
        assert_eq!(directions, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0]);
        // After a run-up play is taken up; between single readings the record says how far the robot went.
        assert!(motions[3..9].iter().all(|motion| motion.x_since_m == f64::INFINITY));
        assert!((motions[2].x_since_m - 0.1).abs() < 1e-12);
        assert!((motions[9].x_since_m - 0.05).abs() < 1e-12);
    }

    #[test]
    fn single_readings_are_at_rest_or_reached_straight() {
        let places = [(0.0, 0.0), (0.02, 0.01), (0.005, 0.013), (0.01, 0.03), (0.011, 0.0)];
        let readings: Vec<(f64, Vec3)> =
            places.iter().enumerate().map(|(n, &(x, y))| (n as f64, at(x, y))).collect();
        // To the first the robot came from one side or the other.
        let directions = [1.0, 1.0, -1.0, 1.0, 1.0];
        for (n, approach) in approaches(&readings).into_iter().enumerate() {
            assert_near(approach.motion.velocity_m_s(), Vec3::zeros());
            assert_eq!(approach.motion.x_direction, directions[n], "reading {n}");
            let otherwise = approach.otherwise.expect("no row");
            assert_eq!(approach.begins, n == 0);
            assert!(n > 0 || otherwise.x_direction == -1.0);
            let moved_m = if n == 0 { Vec3::zeros() } else { readings[n].1 - readings[n - 1].1 };
            assert_near(otherwise.velocity_m_s(), moved_m);
        }
    }

    #[test]
    fn several_drives_at_each_place_and_a_record_without_times_have_rows() {
        let drives: Vec<(f64, Vec3)> =
            (0..24).map(|n| (0.1 * f64::from(n), at(f64::from(n / 3) * STEP_M, 0.0))).collect();
        let approaches_of_drives = approaches(&drives);
        assert!(approaches_of_drives[3..22].iter().all(|a| a.otherwise.is_none()));
        assert_near(approaches_of_drives[4].motion.velocity_m_s(), Vec3::zeros());
        let timeless: Vec<(f64, Vec3)> =
            plane(true, 0.05, 0.7).into_iter().map(|(_, at_m)| (0.0, at_m)).collect();
        for (n, approach) in approaches(&timeless).into_iter().enumerate() {
            assert_near(approach.motion.velocity_m_s(), Vec3::zeros());
            assert_eq!(
                approach.motion.x_direction,
                if (n / SIDE).is_multiple_of(2) { 1.0 } else { -1.0 }
            );
        }
    }
}
