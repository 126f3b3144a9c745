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

/// Readings between two visits of one place at least: two readings that follow one another share what changes slowly. Set by judgement.
const BETWEEN_VISITS: usize = 8;

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
    /// The first round: silent readings, then places spread evenly, every other with a drive of the plan, some of them twice.
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
        let readings =
            self.in_order(self.at_m, places.map(|(n, at_m)| (at_m, Some(drive(n)))).collect());
        let again = repeated(&readings, repeats);
        let readings = self.on_the_move(self.with_revisits(readings, again));
        let first_m = readings.first().map_or(self.at_m, |(at_m, _)| *at_m);
        let course = Course::with_rows(first_m, &readings, &rows, self.robot);
        let course = course.after(std::iter::repeat_n((first_m, None), silent));
        Batch { course, information: None, apart: Vec::new() }
    }

    /// Readings by what they would tell the sets apart, per second, and some spread evenly. `outlooks` gives what the sets that are left
    /// expect of possible readings.
    ///
    /// Each has a place of its own, or comes once again later: readings of a robot that has not moved share the error of its place.
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
                    Some(row) => row.len() <= left_flown.min(left),
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
        let readings = self.in_order(self.at_m, chosen);
        again.extend(repeated(&readings, repeats));
        let readings = self.on_the_move(self.with_revisits(readings, again));
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

    /// Readings on their way, with further visits of some of their places, each where the way passes near by and not soon before or after
    /// another visit; a visit that no free way reaches is left out.
    fn with_revisits(&self, mut readings: Vec<Planned>, visits: Vec<Planned>) -> Vec<Planned> {
        for visit in visits {
            let best = (1..=readings.len()).filter_map(|place| {
                let near = place.saturating_sub(BETWEEN_VISITS)
                    ..readings.len().min(place + BETWEEN_VISITS);
                let is_soon = readings[near].iter().any(|(at_m, _)| *at_m == visit.0);
                Some((self.detour_s(&readings, place, visit.0).filter(|_| !is_soon)?, place))
            });
            if let Some((_, place)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) {
                readings.insert(place, visit);
            }
        }
        readings
    }

    /// Time that a further visit costs before the reading of this number, s; `None` if the ways are not free.
    fn detour_s(&self, readings: &[Planned], number: usize, at_m: Vec3) -> Option<f64> {
        let way_s = |from_m: Vec3, to_m: Vec3| {
            self.robot.is_free(from_m, to_m).then(|| self.robot.move_s(from_m, to_m))
        };
        let before_m = readings[number - 1].0;
        let there_s = way_s(before_m, at_m)?;
        match readings.get(number) {
            Some(&(after_m, _)) => {
                Some(there_s + way_s(at_m, after_m)? - self.robot.move_s(before_m, after_m))
            }
            None => Some(there_s),
        }
    }
}

/// Some of the readings, spread over them, to be taken once more.
fn repeated(readings: &[Planned], count: usize) -> Vec<Planned> {
    let step = (readings.len() / count.max(1)).max(1);
    readings.iter().skip(step / 2).step_by(step).take(count).copied().collect()
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
mod tests;
