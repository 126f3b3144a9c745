//! The readings of a round: where they lower the errors of the map most, per second of this robot.
//!
//! After each choice the covariance of the map is updated as if that reading had been taken (a rank-one step, exact for a normal process
//! whatever the reading will be), so that the readings of a round do not crowd. What is lowered is the sum of the squared variances of the
//! map, in which the least certain places count most: as a reading at c lowers the variance of a place t by S(t,c)²/(S(c,c) + noise), its
//! worth is Σ S(t,t) S(t,c)²/(S(c,c) + noise) over its time. (A. Krause, A. Singh, C. Guestrin, J. Mach. Learn. Res. 9, 235, 2008, compare such
//! criteria; the sum of variances is the A-optimal one.)

use nalgebra::DMatrix;

use fieldgap_acoustics::Vec3;
use fieldgap_closed_loop::{Planned, Robot, route};
use fieldgap_diagnosis::PossibleReading;

use crate::estimate::FieldEstimate;

/// Places of the map among which a round is chosen, and places whose errors are to be lowered. Set by judgement: with twice as many the
/// errors of a map after the same readings differed by less than a tenth.
const POSSIBLE: usize = 500;
const TARGETS: usize = 700;

/// One reading in so many is spread evenly whatever the criterion: these test the standard errors where nothing was expected.
const EVEN_ONE_IN: usize = 6;

/// One reading in so many is a repeat, which tells the noise; and one in so many of the first round is silent.
const REPEAT_ONE_IN: usize = 10;
const SILENT_ONE_IN: usize = 8;

/// The readings of a round.
pub(crate) struct Chosen {
    pub readings: Vec<Planned>,
    /// Of these, spread evenly.
    pub spread: usize,
    /// Share by which they are expected to lower the rms error.
    pub gain: f64,
}

/// What the choices of all rounds have in common.
pub(crate) struct Chooser<'c> {
    pub robot: &'c Robot,
    /// The map: its places that the robot reaches, each with its drive, in an order of which every beginning is spread evenly.
    pub map: &'c [PossibleReading],
    /// Where the robot stands, m.
    pub at_m: Vec3,
    /// Readings that earlier rounds have spread evenly.
    pub spread: usize,
}

impl Chooser<'_> {
    /// The first round: silent readings, then places of the map spread evenly, then repeats.
    pub fn first(&self, count: usize) -> Vec<Planned> {
        let (silent, repeats) = (count / SILENT_ONE_IN, count / REPEAT_ONE_IN);
        let even = self.evenly(count - silent - repeats, self.map.len());
        let mut readings = self.in_order(self.at_m, even);
        let again = self.repeats(&readings, repeats);
        readings.extend(again);
        let first_m = readings.first().map_or(self.at_m, |(at_m, _)| *at_m);
        readings.splice(0..0, std::iter::repeat_n((first_m, None), silent));
        readings
    }

    /// A later round, by what is known of the field.
    pub fn next(&self, field: &dyn FieldEstimate, count: usize) -> Chosen {
        let repeats = count / REPEAT_ONE_IN;
        let even = self.evenly(count / EVEN_ONE_IN, self.map.len());
        let wanted = count - repeats - even.len();
        // Another part of the map in each round.
        let mut possible: Vec<PossibleReading> = even.clone();
        possible.extend(self.evenly_from(self.spread + even.len(), POSSIBLE));
        let targets = self.evenly_from(self.spread + POSSIBLE, TARGETS);
        let mut left = Left::of(field, &targets, &possible);
        let before = left.sum();
        let mut chosen = even;
        let spread = chosen.len();
        (0..chosen.len()).for_each(|number| left.choose(number));
        let mut seconds: Vec<f64> = possible
            .iter()
            .map(|one| self.way_s(one.at_m, chosen.iter().map(|taken| taken.at_m)))
            .collect();
        for _ in 0..wanted {
            let worth = |number: &usize| left.worth(*number) / seconds[*number];
            let best = (0..possible.len()).max_by(|a, b| worth(a).total_cmp(&worth(b)));
            let Some(best) = best else { break };
            left.choose(best);
            let taken = possible[best];
            for (one, seconds) in possible.iter().zip(&mut seconds) {
                *seconds = seconds.min(self.way_s(one.at_m, [taken.at_m]));
            }
            chosen.push(taken);
        }
        let mut readings = self.in_order(self.at_m, chosen);
        let again = self.repeats(&readings, repeats);
        readings.extend(again);
        let gain = 1.0 - (left.sum() / before.max(f64::MIN_POSITIVE)).sqrt();
        Chosen { readings, spread, gain }
    }

    /// Places of the map that the next readings spread evenly would take.
    fn evenly(&self, count: usize, most: usize) -> Vec<PossibleReading> {
        self.evenly_from(self.spread, count.min(most))
    }

    fn evenly_from(&self, first: usize, count: usize) -> Vec<PossibleReading> {
        let places = (first..first + count.min(self.map.len())).map(|n| n % self.map.len());
        places.map(|n| self.map[n]).collect()
    }

    /// Time of a reading and of the way to it from the nearest of some places, s.
    fn way_s(&self, to_m: Vec3, from: impl IntoIterator<Item = Vec3>) -> f64 {
        let ways = from.into_iter().map(|from_m| self.robot.move_s(from_m, to_m));
        self.robot.reading_s() + ways.reduce(f64::min).unwrap_or(0.0)
    }

    /// Readings on a short way from a place, without those that no free way reaches.
    fn in_order(&self, from_m: Vec3, readings: Vec<PossibleReading>) -> Vec<Planned> {
        let places_m: Vec<Vec3> = readings.iter().map(|one| one.at_m).collect();
        let order = route(from_m, &places_m, |from_m, to_m| {
            self.robot.is_free(from_m, to_m).then(|| self.robot.move_s(from_m, to_m))
        });
        order.into_iter().map(|n| (readings[n].at_m, Some(readings[n].focus))).collect()
    }

    /// Some of the readings once more, spread over them, on the way back.
    fn repeats(&self, readings: &[Planned], count: usize) -> Vec<Planned> {
        let step = (readings.len() / count.max(1)).max(1);
        let again = readings.iter().rev().skip(step / 2).step_by(step).take(count);
        let mut at_m = readings.last().map_or(self.at_m, |(at_m, _)| *at_m);
        let free = again.filter(|(to_m, _)| {
            let is_free = self.robot.is_free(at_m, *to_m);
            if is_free {
                at_m = *to_m;
            }
            is_free
        });
        free.copied().collect()
    }
}

/// The variances of a map that are left, and what possible readings would take of them.
struct Left {
    /// Covariance of targets and possible readings.
    with: DMatrix<f64>,
    /// Covariance of possible readings.
    between: DMatrix<f64>,
    /// Variances of the targets.
    targets: Vec<f64>,
    noise: Vec<f64>,
}

impl Left {
    fn of(
        field: &dyn FieldEstimate,
        targets: &[PossibleReading],
        possible: &[PossibleReading],
    ) -> Self {
        let foretold = field.foretold(possible, 1.0);
        Self {
            with: field.covariance(targets, possible),
            between: field.covariance(possible, possible),
            targets: field.map(targets).iter().map(|e| e.standard_error.powi(2)).collect(),
            noise: foretold.iter().map(|f| f.noise.powi(2)).collect(),
        }
    }

    fn sum(&self) -> f64 {
        self.targets.iter().sum()
    }

    fn reading_variance(&self, number: usize) -> f64 {
        (self.between[(number, number)].max(0.0) + self.noise[number]).max(f64::MIN_POSITIVE)
    }

    fn worth(&self, number: usize) -> f64 {
        let with = self.with.column(number);
        let taken = with.iter().zip(&self.targets).map(|(s, variance)| variance * s * s);
        taken.sum::<f64>() / self.reading_variance(number)
    }

    /// Takes a reading.
    fn choose(&mut self, number: usize) {
        let variance = self.reading_variance(number);
        let with = self.with.column(number).into_owned();
        let between = self.between.column(number).into_owned();
        for (target, s) in self.targets.iter_mut().zip(&with) {
            *target = (*target - s * s / variance).max(0.0);
        }
        self.with.ger(-1.0 / variance, &with, &between, 1.0);
        self.between.ger(-1.0 / variance, &between, &between, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_acquisition::RigSetup;

    use super::*;
    use crate::estimate::{Estimate, Foretold};

    const NOISE: f64 = 0.5;

    /// A normal process with a covariance that is known, before any reading.
    struct Known;

    fn covariance(one: &PossibleReading, other: &PossibleReading) -> f64 {
        // Twice as uncertain above 100 mm.
        let size = |at: &PossibleReading| if at.at_m.z > 0.1 { 2.0 } else { 1.0 };
        let distance = (one.at_m - other.at_m).norm() / 8e-3;
        size(one) * size(other) * (-0.5 * distance * distance).exp()
    }

    impl FieldEstimate for Known {
        fn map(&self, places: &[PossibleReading]) -> Vec<Estimate> {
            let of = |place| Estimate {
                amplitude: 1.0,
                standard_error: covariance(place, place).sqrt(),
            };
            places.iter().map(of).collect()
        }

        fn foretold(&self, places: &[PossibleReading], _moment: f64) -> Vec<Foretold> {
            let of = |_| Foretold { reading: 1.0, standard_error: 1.0, noise: NOISE };
            places.iter().map(of).collect()
        }

        fn covariance(
            &self,
            targets: &[PossibleReading],
            possible: &[PossibleReading],
        ) -> DMatrix<f64> {
            DMatrix::from_fn(targets.len(), possible.len(), |i, j| {
                covariance(&targets[i], &possible[j])
            })
        }
    }

    fn grid() -> Vec<PossibleReading> {
        let at = |n: usize| {
            let (x, y, z) = (n % 8, n / 8 % 8, n / 64);
            let at_m = Vec3::new(x as f64 * 4e-3, y as f64 * 4e-3, 0.08 + 0.04 * z as f64);
            PossibleReading { at_m, focus: 0, from_below: true, velocity_m_s: Vec3::zeros() }
        };
        (0..128).map(at).collect()
    }

    #[test]
    fn choosing_leaves_the_variances_of_the_direct_formula() {
        let grid = grid();
        let (targets, possible) = (&grid[..20], &grid[10..40]);
        let mut left = Left::of(&Known, targets, possible);
        let chosen = [3, 17, 18, 3];
        chosen.iter().for_each(|&number| left.choose(number));
        let taken: Vec<PossibleReading> = chosen.iter().map(|&number| possible[number]).collect();
        let mut between = Known.covariance(&taken, &taken);
        (0..taken.len()).for_each(|n| between[(n, n)] += NOISE * NOISE);
        let with = Known.covariance(targets, &taken);
        let gone = &with * between.try_inverse().expect("positive") * with.transpose();
        for (n, target) in targets.iter().enumerate() {
            let direct = covariance(target, target) - gone[(n, n)];
            assert!((left.targets[n] - direct).abs() < 1e-10, "{n}");
        }
    }

    #[test]
    fn a_round_goes_where_the_map_is_uncertain_and_does_not_crowd() {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
        let robot = Robot::of(&RigSetup::read(&rig).expect("the rig file"));
        let map = grid();
        let chooser = Chooser { robot: &robot, map: &map, at_m: robot.home_m(), spread: 0 };
        let first = chooser.first(64);
        assert_eq!(first.len(), 64);
        assert!(first[..8].iter().all(|(_, focus)| focus.is_none()));
        let Chosen { readings, spread, gain } = chooser.next(&Known, 24);
        assert_eq!((readings.len(), spread), (24, 4));
        assert!(gain > 0.1, "{gain}");
        let once = &readings[..22];
        let above = once.iter().filter(|(at_m, _)| at_m.z > 0.1).count();
        // Half of those that are spread evenly lie above, and two thirds of the others.
        assert!(above >= 13, "{above}");
        // Neighbours are correlated: hardly any place is taken twice.
        let mut places: Vec<_> = once.iter().map(|(at_m, _)| at_m.map(f64::to_bits)).collect();
        places.sort_by_key(|at| (at.x, at.y, at.z));
        places.dedup();
        assert!(places.len() >= 20, "{}", places.len());
    }
}
