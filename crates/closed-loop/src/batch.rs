//! The readings of a round: what is measured next, and in which order.

use std::ops::Range;

use fieldgap_acoustics::{Vec3, golden_section};
use fieldgap_diagnosis::{Outlook, PossibleReading};
use fieldgap_records::{ClosedLoop, Criterion};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::flights::{Course, Flying, ROW, Row};
use crate::information::Contest;
use crate::places::{places_m, rounded_m};
use crate::robot::{Planned, Robot};
use crate::route::route;

/// Sets that are held against each other at most: more have probabilities too small to matter.
pub(crate) const MOST_SETS: usize = 8;

/// Share of the probability that is dealt out evenly among them, because probabilities from few readings are too sure of themselves. Set by
/// judgement.
pub(crate) const DEALT_OUT: f64 = 0.2;

/// Possible places among which a round is chosen, and drives of each. Set by judgement: with twice as many the information of a round grew
/// by less than a tenth.
const POSSIBLE_PLACES: usize = 500;
const DRIVES_OF_A_PLACE: usize = 3;

/// Information of a reading below which it tells the sets no further apart, nats: a thousand such readings tell a nat.
const LEAST_TOLD: f64 = 1e-3;

/// One reading in so many is spread evenly whatever the criterion: what no set of the catalogue makes shows only there.
const EVEN_ONE_IN: usize = 4;

/// One reading in so many is a repeat, which tells the noise; and one in so many of the first round is silent: these cost no move, and
/// tell the additive noise and a floor apart, which otherwise takes up an error of that noise.
const REPEAT_ONE_IN: usize = 10;
const SILENT_ONE_IN: usize = 6;

/// One reading in so many of those that are spread evenly is flown, where the rig flies: what acts in motion alone shows only there. As many
/// of those that test a cause.
const FLOWN_ONE_IN: usize = 2;

/// Share of the readings chosen for what they tell that are flown at most, however little time these cost: those of a pass share the error of
/// its place, and lie on one line. Set by judgement.
const MOST_FLOWN: f64 = 0.5;

/// Places of rows among which a round is chosen, each flown at both speeds in both directions. Set by judgement.
const POSSIBLE_ROWS: usize = 24;
const WAYS_OF_A_ROW: usize = 4;

/// A batch of readings, and what was expected of it.
pub(crate) struct Batch {
    pub course: Course,
    /// Expected information about which set holds, nats; `None` where no set was asked.
    pub information: Option<f64>,
    /// Expected divergence of each set from the most probable, nats, in the order of the probabilities.
    pub apart: Vec<f64>,
}

impl Batch {
    /// Number of its readings.
    pub fn len(&self) -> usize {
        self.course.readings.len()
    }
}

/// What the choices of all rounds have in common.
pub(crate) struct Chooser<'c> {
    pub settings: &'c ClosedLoop,
    pub robot: &'c Robot,
    /// How the rig flies; `None` if it does not.
    pub flying: Option<&'c Flying>,
    /// Rounds so far.
    pub rounds: usize,
    /// Drives of the plan, and all drives.
    pub planned_drives: usize,
    pub drives: usize,
    /// Where the robot stands, m.
    pub at_m: Vec3,
    /// Places of the even sequence that earlier rounds have used.
    pub places_used: usize,
}

impl Chooser<'_> {
    /// The first round: silent readings, then places spread evenly, every other with a drive of the plan, then repeats.
    pub fn first(&self) -> Batch {
        let count = self.settings.first_readings;
        let (silent, repeats) = (count / SILENT_ONE_IN, count / REPEAT_ONE_IN);
        let further = self.drives - self.planned_drives;
        let drive = |n: usize| match (n % 2, further) {
            (1, 1..) => self.planned_drives + one_of(further, n / 2),
            _ => one_of(self.planned_drives, n / 2),
        };
        let once = count - silent - repeats;
        let rows = self.even_rows(once / FLOWN_ONE_IN);
        let places = self.even_places(once - flown(&rows)).enumerate();
        let mut readings =
            self.in_order(self.at_m, places.map(|(n, at_m)| (at_m, Some(drive(n)))).collect());
        let again = self.repeats(&readings, repeats);
        readings.extend(again);
        let readings = self.on_the_move(readings);
        let first_m = readings.first().map_or(self.at_m, |(at_m, _)| *at_m);
        let course = Course::with_rows(first_m, &readings, &rows, self.robot);
        let course = course.after(std::iter::repeat_n((first_m, None), silent));
        Batch { course, information: None, apart: Vec::new() }
    }

    /// Readings by what they would tell the sets apart, per second, and some spread evenly. `outlooks` gives what the sets that are left
    /// expect of possible readings.
    ///
    /// Each has a place of its own, or comes once again on the way back: readings of a robot that has not moved share the error of its place.
    pub fn next(
        &self,
        outlooks: impl Fn(&[PossibleReading]) -> Vec<Outlook>,
        count: usize,
    ) -> Batch {
        let repeats = count / REPEAT_ONE_IN;
        let even = match self.settings.criterion {
            Criterion::Even => count - repeats,
            _ => count / EVEN_ONE_IN,
        };
        let mut rows = self.even_rows(even / FLOWN_ONE_IN);
        let even = even - flown(&rows);
        let mut possible = self.possible();
        let mut offers: Vec<Offer> = (0..possible.len()).map(Offer::at_rest).collect();
        // The even rows are taken in any case.
        let others: Vec<Row> = self.possible_rows(rows.len()).collect();
        let of_rows = offers.len();
        for (number, row) in rows.iter().chain(&others).enumerate() {
            let from = possible.len();
            possible.extend(row.possible(number.is_multiple_of(2)));
            offers.push(Offer { readings: from..possible.len(), row: Some(*row), seconds: 0.0 });
        }
        let outlooks = outlooks(&possible);
        let mut contest = Contest::new(&outlooks, DEALT_OUT);
        let mut chosen: Vec<Planned> = Vec::new();
        for (at_m, focus) in self.even_readings(even) {
            let same = |one: &PossibleReading| one.at_m == at_m && one.focus == focus;
            if let Some(number) = possible.iter().position(same) {
                contest.choose(number);
            }
            chosen.push((at_m, Some(focus)));
        }
        let taken = offers.drain(of_rows..of_rows + rows.len()).flat_map(|offer| offer.readings);
        taken.for_each(|reading| contest.choose(reading));
        for offer in &mut offers {
            let to_m = offer.begins_m(&possible);
            offer.seconds = self.way_s(offer, to_m, chosen.iter().map(|(at_m, _)| *at_m));
        }
        let mut again: Vec<Planned> = Vec::new();
        let mut visited_twice: Vec<Vec3> = Vec::new();
        let mut left = count - repeats - even - flown(&rows);
        let mut left_flown = (MOST_FLOWN * left as f64) as usize;
        while left > 0 {
            let best_by = |told: &dyn Fn(&Offer) -> f64| {
                let free = offers.iter().enumerate().filter(|(_, offer)| match offer.row {
                    Some(row) => row.len() <= left_flown,
                    None => !visited_twice.contains(&possible[offer.readings.start].at_m),
                });
                let worth = free.map(|(number, offer)| (told(offer), number));
                worth.max_by(|a, b| {
                    (a.0 / offers[a.1].seconds).total_cmp(&(b.0 / offers[b.1].seconds))
                })
            };
            let informs = match self.settings.criterion {
                Criterion::Parameters => None,
                _ => best_by(&|offer| contest.gain(offer.readings.clone())),
            };
            // Where all sets are apart already, the next readings put the most probable one to the test where it is least sure.
            let informs = informs.filter(|(told, _)| *told > LEAST_TOLD);
            let best =
                informs.or_else(|| best_by(&|offer| contest.narrowing(offer.readings.clone())));
            let Some((_, best)) = best else { break };
            let Offer { readings, row, .. } = offers[best].clone();
            left -= readings.len();
            readings.clone().for_each(|reading| contest.choose(reading));
            let PossibleReading { at_m, focus, .. } = possible[readings.start];
            let stands_m = row.map_or(at_m, |row| row.ends_m()[1]);
            for offer in &mut offers {
                // Beside a chosen place the way is short; at that place itself the robot has to come back.
                let to_m = offer.begins_m(&possible);
                if to_m != stands_m {
                    offer.seconds = offer.seconds.min(self.way_s(offer, to_m, [stands_m]));
                }
            }
            if let Some(row) = row {
                left_flown -= row.len();
                rows.push(row);
                offers.remove(best);
                continue;
            }
            match chosen.iter().any(|(place_m, _)| *place_m == at_m) {
                true => {
                    again.push((at_m, Some(focus)));
                    visited_twice.push(at_m);
                }
                false => chosen.push((at_m, Some(focus))),
            }
        }
        let mut readings = self.in_order(self.at_m, chosen);
        let end_m = readings.last().map_or(self.at_m, |(at_m, _)| *at_m);
        readings.extend(self.in_order(end_m, again));
        readings.extend(self.repeats(&readings, repeats));
        let readings = self.on_the_move(readings);
        let apart = (1..outlooks.len()).map(|other| contest.apart(0, other)).collect();
        let course = Course::with_rows(self.at_m, &readings, &rows, self.robot);
        Batch { course, information: Some(contest.information()), apart }
    }

    /// Fresh readings at the drives of the plan, drawn at random where the plan wants the cure verified.
    pub fn fresh(&self, round: usize) -> Batch {
        let within = &self.settings.verify_within;
        // Each verification draws its own places; the same round draws the same ones, so that a resumed loop goes on alike.
        let mut draws = ChaCha8Rng::seed_from_u64(round as u64);
        let size = within.most - within.least;
        let mut drawn_m = || {
            let at_mm = within.least + size.map(|size| size * draws.random_range(0.0..1.0));
            rounded_m(at_mm)
        };
        let wanted = self.settings.verify_readings;
        let (mut places, mut rows) = (Vec::new(), Vec::new());
        for tried in 0..100 * wanted {
            let left = wanted - places.len() - flown(&rows);
            let at_m = drawn_m();
            let about_rows = self.flying.filter(|_| flown(&rows) + ROW <= wanted / FLOWN_ONE_IN);
            if let Some(flying) = about_rows.filter(|_| tried < wanted) {
                let focus = rows.len() % self.planned_drives;
                rows.extend(flying.row(at_m, focus, round + rows.len(), within, self.robot));
            } else if left == 0 {
                break;
            } else if self.robot.reaches(at_m) {
                places.push((at_m, Some(places.len() % self.planned_drives)));
            }
        }
        let readings = self.in_order(self.at_m, places);
        let course = Course::with_rows(self.at_m, &readings, &rows, self.robot);
        Batch { course, information: None, apart: Vec::new() }
    }

    /// Time of what is offered and of the way to it from the nearest of some places, s.
    fn way_s(&self, offer: &Offer, to_m: Vec3, from: impl IntoIterator<Item = Vec3>) -> f64 {
        let ways = from.into_iter().map(|from_m| self.robot.move_s(from_m, to_m));
        let taken_s = offer.row.map_or_else(|| self.robot.reading_s(), |row| row.pass_s());
        taken_s + ways.reduce(f64::min).unwrap_or(0.0)
    }

    /// Rows spread evenly, of so many readings at most; none if the rig does not fly.
    fn even_rows(&self, readings: usize) -> Vec<Row> {
        self.rows(0).take(readings / ROW).collect()
    }

    /// Rows among which a round is chosen, after so many of the same sequence: each flown in all ways.
    fn possible_rows(&self, even: usize) -> impl Iterator<Item = Row> {
        let about = self.rows(even).take(POSSIBLE_ROWS).enumerate();
        about
            .flat_map(|(number, row)| (0..WAYS_OF_A_ROW).map(move |way| (number, row, way)))
            .filter_map(|(number, row, way)| {
                self.row(row.middle_m(), row.focus, way + WAYS_OF_A_ROW * (number % 2))
            })
    }

    /// Rows about places of the even sequence, one after another in all ways.
    fn rows(&self, after: usize) -> impl Iterator<Item = Row> {
        let drive = |n: usize| one_of(self.drives, self.places_used + n);
        let count = self.flying.map_or(0, |_| 100 * POSSIBLE_ROWS);
        let about = places_m(&self.settings.within, self.places_used).enumerate().take(count);
        about.filter_map(move |(n, at_m)| self.row(at_m, drive(n), self.rounds + n)).skip(after)
    }

    fn row(&self, about_m: Vec3, focus: usize, way: usize) -> Option<Row> {
        self.flying?.row(about_m, focus, way, &self.settings.within, self.robot)
    }

    fn even_places(&self, count: usize) -> impl Iterator<Item = Vec3> {
        places_m(&self.settings.within, self.places_used)
            .take(100 * count.max(1))
            .filter(|at_m| self.robot.reaches(*at_m))
            .take(count)
    }

    /// Places spread evenly, each with a drive in turn.
    fn even_readings(&self, count: usize) -> Vec<(Vec3, usize)> {
        let places = self.even_places(count).enumerate();
        places.map(|(n, at_m)| (at_m, one_of(self.drives, self.places_used + n))).collect()
    }

    /// The readings among which a round is chosen: the places that it takes in any case, and more of the same sequence.
    fn possible(&self) -> Vec<PossibleReading> {
        self.even_places(POSSIBLE_PLACES)
            .enumerate()
            .flat_map(|(n, at_m)| {
                (0..DRIVES_OF_A_PLACE.min(self.drives)).map(move |k| PossibleReading {
                    at_m,
                    // Another third of the drives at each place, the drive of an even reading first.
                    focus: (one_of(self.drives, self.places_used + n)
                        + k * self.drives.div_ceil(DRIVES_OF_A_PLACE))
                        % self.drives,
                    from_below: n % 2 == 0,
                    velocity_m_s: Vec3::zeros(),
                })
            })
            .collect()
    }

    /// Readings on a short way from a place, without those that no free way reaches.
    fn in_order(&self, from_m: Vec3, readings: Vec<Planned>) -> Vec<Planned> {
        let places_m: Vec<Vec3> = readings.iter().map(|(at_m, _)| *at_m).collect();
        let order = route(from_m, &places_m, |from_m, to_m| {
            self.robot.is_free(from_m, to_m).then(|| self.robot.move_s(from_m, to_m))
        });
        order.into_iter().map(|index| readings[index]).collect()
    }

    /// The readings before which the robot moves.
    fn on_the_move(&self, mut readings: Vec<Planned>) -> Vec<Planned> {
        let mut at_m = self.at_m;
        readings.retain(|(to_m, _)| {
            let moves = *to_m != at_m;
            at_m = *to_m;
            moves
        });
        readings
    }

    /// Some of the readings once more, spread over them, on the way back.
    fn repeats(&self, readings: &[Planned], count: usize) -> Vec<Planned> {
        let Some(&(last_m, _)) = readings.last() else { return Vec::new() };
        let step = (readings.len() / count.max(1)).max(1);
        let mut at_m = last_m;
        let again = readings.iter().rev().skip(step / 2).step_by(step).take(count);
        again
            .filter(|(to_m, _)| {
                let is_free = self.robot.is_free(at_m, *to_m);
                if is_free {
                    at_m = *to_m;
                }
                is_free
            })
            .copied()
            .collect()
    }
}

/// What can be taken at once: a reading at rest, or a row.
#[derive(Clone)]
struct Offer {
    /// Numbers of the possible readings.
    readings: Range<usize>,
    row: Option<Row>,
    /// Time that it takes with its way, s.
    seconds: f64,
}

impl Offer {
    fn at_rest(reading: usize) -> Self {
        Self { readings: reading..reading + 1, row: None, seconds: 0.0 }
    }

    /// Where the robot has to come to, m.
    fn begins_m(&self, possible: &[PossibleReading]) -> Vec3 {
        self.row.map_or_else(|| possible[self.readings.start].at_m, |row| row.ends_m()[0])
    }
}

/// Readings of some rows.
fn flown(rows: &[Row]) -> usize {
    rows.iter().map(Row::len).sum()
}

/// One of so many drives for a place of the even sequence. Drives in turn would follow the digits of its coordinates, so that each drive was
/// measured at the same heights only.
fn one_of(drives: usize, number: usize) -> usize {
    ((golden_section::even_fraction(number) * drives as f64) as usize).min(drives - 1)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_acquisition::RigSetup;
    use fieldgap_input::TomlSource;
    use fieldgap_records::{BoxMm, Plan};
    use nalgebra::DMatrix;

    use super::*;

    fn robot() -> Robot {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
        Robot::of(&RigSetup::read(&rig).expect("the rig file"))
    }

    fn settings(criterion: Criterion) -> ClosedLoop {
        let within =
            BoxMm { least: Vec3::new(-30.0, -30.0, 60.0), most: Vec3::new(30.0, 30.0, 140.0) };
        ClosedLoop { criterion, ..ClosedLoop::within(within) }
    }

    fn chooser<'c>(settings: &'c ClosedLoop, robot: &'c Robot) -> Chooser<'c> {
        Chooser {
            settings,
            robot,
            flying: None,
            rounds: 0,
            planned_drives: 2,
            drives: 9,
            at_m: robot.home_m(),
            places_used: 0,
        }
    }

    /// Two sets that differ above 100 mm alone, by so many standard deviations; one parameter of both moves readings below.
    fn above(possible: &[PossibleReading], sigma: f64) -> Vec<Outlook> {
        let is_above = |one: &PossibleReading| if one.at_m.z > 0.1 { 1.0 } else { 0.0 };
        let set = |share: f64| Outlook {
            effects: Vec::new(),
            probability: 0.5,
            means: possible.iter().map(|one| share * sigma * is_above(one)).collect(),
            variances: vec![1.0; possible.len()],
            slopes: DMatrix::from_fn(1, possible.len(), |_, n| 1.0 - is_above(&possible[n])),
            covariance: DMatrix::identity(1, 1),
        };
        vec![set(0.0), set(1.0)]
    }

    fn share_above(batch: &Batch) -> f64 {
        let above = batch.course.readings.iter().filter(|(at_m, _)| at_m.z > 0.1).count();
        above as f64 / batch.course.readings.len() as f64
    }

    #[test]
    fn the_first_round_has_silence_places_of_both_kinds_of_drives_and_repeats() {
        let (settings, robot) = (settings(Criterion::Information), robot());
        let Batch { course: Course { readings, .. }, .. } = chooser(&settings, &robot).first();
        assert_eq!(readings.len(), 240);
        assert!(readings[..40].iter().all(|(_, focus)| focus.is_none()));
        let driven = &readings[40..];
        let (once, again) = driven.split_at(driven.len() - 24);
        assert!(again.iter().all(|reading| once.contains(reading)));
        let planned = once.iter().filter(|(_, focus)| focus.is_some_and(|focus| focus < 2));
        assert_eq!(2 * planned.count(), once.len());
        assert!((0..9).all(|drive| once.iter().any(|(_, focus)| *focus == Some(drive))));
        assert!(once.windows(2).all(|pair| pair[0].0 != pair[1].0));
    }

    #[test]
    fn readings_are_taken_where_the_sets_differ_or_where_the_first_is_least_sure() {
        let robot = robot();
        let chosen = |criterion, sigma| {
            let settings = settings(criterion);
            let outlooks = |possible: &[PossibleReading]| above(possible, sigma);
            chooser(&settings, &robot).next(outlooks, 96)
        };
        let share = |criterion| share_above(&chosen(criterion, 0.2));
        // Of a round a quarter is even; so half of a quarter lies where nothing is to be learnt.
        assert!(share(Criterion::Information) > 0.75, "{}", share(Criterion::Information));
        assert!(share(Criterion::Parameters) < 0.35, "{}", share(Criterion::Parameters));
        assert!((0.35..0.65).contains(&share(Criterion::Even)), "{}", share(Criterion::Even));
        // Sets that the even readings part already leave the rest to what the first is least sure of.
        let parted = chosen(Criterion::Information, 5.0);
        let least_sure = chosen(Criterion::Parameters, 5.0);
        assert_eq!(parted.course.readings, least_sure.course.readings);
    }

    /// Readings of a robot at rest share the error of its place: they look sure, and tell nothing of how places scatter.
    #[test]
    fn the_robot_moves_before_each_reading_and_comes_to_no_place_more_than_twice_for_what_it_tells()
    {
        let (settings, robot) = (settings(Criterion::Information), robot());
        // One place tells by far the most.
        let outlooks = |possible: &[PossibleReading]| {
            let mut sets = above(possible, 0.2);
            let most = possible.iter().position(|one| one.at_m.z > 0.1).expect("some are above");
            sets[1].means[most] = 3.0;
            sets
        };
        let Batch { course: Course { readings, .. }, .. } =
            chooser(&settings, &robot).next(outlooks, 96);
        assert!(readings.windows(2).all(|pair| pair[0].0 != pair[1].0));
        assert!(readings.len() > 90, "{}", readings.len());
        let (once, _repeats) = readings.split_at(readings.len() - 9);
        for (at_m, _) in once {
            assert!(once.iter().filter(|(other_m, _)| other_m == at_m).count() <= 2);
        }
    }

    #[test]
    fn what_is_told_counts_per_second() {
        let (settings, robot) = (settings(Criterion::Information), robot());
        let chooser = chooser(&settings, &robot);
        let batch = chooser.next(|possible| above(possible, 0.2), 96);
        let way_s = |readings: &[Planned]| -> f64 {
            readings.windows(2).map(|pair| robot.move_s(pair[0].0, pair[1].0)).sum()
        };
        // As many readings spread evenly, with as many repeats, would take longer.
        let evenly = ClosedLoop { criterion: Criterion::Even, ..settings.clone() };
        let evenly = Chooser { settings: &evenly, ..chooser };
        let even = evenly.next(|possible| above(possible, 0.2), 96).course.readings;
        let [way_s, even_s] = [&batch.course.readings, &even].map(|r| way_s(r) / r.len() as f64);
        assert!(way_s < even_s, "{way_s} {even_s}");
        // Some seventy readings above of 0.2 standard deviations: half of the sum of their squares.
        assert!((0.9..1.9).contains(&batch.apart[0]), "{:?}", batch.apart);
        assert!(batch.information.expect("sets were asked") > 0.2);
    }

    #[test]
    fn a_verification_draws_the_same_places_again_and_others_in_another_round() {
        let (mut settings, robot) = (settings(Criterion::Information), robot());
        settings.verify_within =
            BoxMm { least: Vec3::new(-5.0, -5.0, 90.0), most: Vec3::new(5.0, 5.0, 110.0) };
        let chooser = chooser(&settings, &robot);
        let drawn = |round| chooser.fresh(round).course.readings;
        assert_eq!(drawn(3).len(), 64);
        assert_eq!(drawn(3), drawn(3));
        assert!(drawn(3).iter().all(|reading| !drawn(4).contains(reading)));
        let inside = |at_m: &Vec3| at_m.x.abs() <= 5e-3 && (0.09..=0.11).contains(&at_m.z);
        assert!(drawn(3).iter().all(|(at_m, focus)| inside(at_m) && focus.is_some_and(|f| f < 2)));
    }

    #[test]
    fn every_drive_is_measured_in_every_part_of_the_box() {
        let within = BoxMm { least: Vec3::repeat(-10.0), most: Vec3::repeat(10.0) };
        let mut counts = [[0; 5]; 10];
        for (n, at_m) in places_m(&within, 0).take(500).enumerate() {
            let part = ((at_m.z * 1e3 + 10.0) / 4.0) as usize;
            counts[one_of(10, n)][part.min(4)] += 1;
        }
        assert!(counts.iter().flatten().all(|count| (5..=16).contains(count)), "{counts:?}");
    }

    /// The flights of a plan with `[fly]` on the rig of these tests.
    fn flying(speed_mm_s: f64) -> Flying {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
        let text = format!(
            "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n\
             [fly]\nspeed_mm_s = {speed_mm_s}\n[closed_loop]\nmin_mm = [-30, -30, 60]\nmax_mm = [30, 30, 140]\n"
        );
        let plan = Plan::parse(TomlSource::new(Path::new("plan.toml"), text)).expect("a plan");
        Flying::of(&plan, &RigSetup::read(&rig).expect("the rig file")).expect("it flies")
    }

    fn speeds_of(course: &Course) -> Vec<f64> {
        course.rows.iter().map(|(_, row)| row.speed_mm_s.get()).collect()
    }

    #[test]
    fn half_of_a_first_look_is_flown_at_both_speeds_and_either_way() {
        let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
        let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
        let Batch { course, .. } = chooser.first();
        assert_eq!(course.readings.len(), 240);
        // Of 176 that are neither silent nor repeats.
        assert_eq!(course.rows.len(), 88 / ROW);
        for speed in [180.0, 60.0] {
            assert!(speeds_of(&course).iter().filter(|mm_s| **mm_s == speed).count() >= 5);
        }
        let mut ways: Vec<[i8; 3]> = course
            .rows
            .iter()
            .map(|(first, row)| {
                let places_m: Vec<Vec3> = row.places_m().collect();
                assert!(row.readings().eq(course.readings[*first..][..ROW].iter().copied()));
                (places_m[1] - places_m[0])
                    .map(|along| along.signum() as i8 * i8::from(along != 0.0))
            })
            .map(Into::into)
            .collect();
        ways.sort_unstable();
        ways.dedup();
        assert_eq!(ways, [[-1, 0, 0], [0, -1, 0], [0, 1, 0], [1, 0, 0]]);
        // The robot stands at the last place of a round.
        assert!(course.rows.iter().all(|(first, _)| first + ROW < course.readings.len()));
        let speeds = course.speeds_mm_s().expect("some are flown");
        assert_eq!(speeds.iter().filter(|mm_s| **mm_s > 0.0).count(), 88);
    }

    /// A lag and play that shift readings alike at the slower speed and along x; at rest neither does.
    fn lag_or_play(possible: &[PossibleReading], same_at_m_s: f64, sigma: f64) -> Vec<Outlook> {
        let set = |means: &dyn Fn(f64) -> f64| Outlook {
            effects: Vec::new(),
            probability: 0.5,
            means: possible.iter().map(|one| sigma * means(one.velocity_m_s.x)).collect(),
            variances: vec![1.0; possible.len()],
            slopes: DMatrix::zeros(0, possible.len()),
            covariance: DMatrix::zeros(0, 0),
        };
        let play = |along: f64| if along == 0.0 { 0.0 } else { along.signum() };
        vec![set(&|along| along / same_at_m_s), set(&play)]
    }

    #[test]
    fn where_one_speed_leaves_a_lag_and_play_alike_rows_are_flown_at_the_other() {
        let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
        let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
        for (same_at_m_s, other_mm_s) in [(0.06, 180.0), (0.18, 60.0)] {
            let outlooks = |possible: &[PossibleReading]| lag_or_play(possible, same_at_m_s, 0.2);
            let Batch { course, information, .. } = chooser.next(outlooks, 96);
            assert!(information.expect("sets were asked") > 0.1);
            // One row is of the even ones; the others are those that were chosen.
            let telling = course.rows.iter().filter(|(_, row)| {
                let mut possible = row.possible(true);
                row.speed_mm_s.get() == other_mm_s && possible.all(|one| one.velocity_m_s.x != 0.0)
            });
            assert!(course.rows.len() >= 3, "{}", course.rows.len());
            assert!(telling.count() + 1 >= course.rows.len(), "{:?}", course.rows);
            assert!(course.readings.len() > 90);
        }
    }

    #[test]
    fn rows_are_flown_where_they_tell_more_in_a_second_and_no_more_than_half_of_what_is_chosen() {
        let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
        let at_rest = chooser(&settings, &robot);
        let chooser = Chooser { flying: Some(&flying), ..at_rest };
        // Places above tell alike, in motion or at rest; a pass takes less time.
        let Batch { course, .. } = chooser.next(|possible| above(possible, 0.2), 96);
        let flown = course.rows.len() * ROW;
        // Half of 24 even readings make one row, and half of the other 63 make three.
        assert_eq!(flown, 4 * ROW);
        let evenly = ClosedLoop { criterion: Criterion::Even, ..settings.clone() };
        let even = Chooser { settings: &evenly, ..chooser };
        let Batch { course, .. } = even.next(|possible| above(possible, 0.2), 96);
        assert_eq!(course.rows.len(), 43 / ROW);
    }

    #[test]
    fn half_of_a_verification_is_flown_at_fresh_places_at_both_speeds() {
        let (settings, robot, flying) = (settings(Criterion::Information), robot(), flying(180.0));
        let chooser = Chooser { flying: Some(&flying), ..chooser(&settings, &robot) };
        let Batch { course, .. } = chooser.fresh(3);
        assert_eq!((course.readings.len(), course.rows.len()), (64, 4));
        let mut speeds = speeds_of(&course);
        speeds.sort_by(f64::total_cmp);
        assert_eq!(speeds, [60.0, 60.0, 180.0, 180.0]);
        assert_eq!(chooser.fresh(3).course, course);
        assert_ne!(chooser.fresh(4).course, course);
        assert!(course.readings.iter().all(|(_, focus)| focus.is_some_and(|focus| focus < 2)));
        // None of few readings is flown.
        let few = ClosedLoop { verify_readings: 2 * ROW - 1, ..settings.clone() };
        let few = Chooser { settings: &few, ..chooser };
        assert!(few.fresh(3).course.rows.is_empty());
    }
}
