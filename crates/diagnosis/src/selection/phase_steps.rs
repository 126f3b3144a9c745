//! The numbers of phase steps, and where drives count them from, that explain most.
//!
//! The zero of a drive matters only by which phases are rounded up and which down, so there are as many zeros as elements. From one to the next one
//! element is turned by a step: all of them are tried.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::effects::phase_quantisation::{
    FIRST_DIGITS, first_common_zeros, rounded_rad, step_rad, steps_in_a_period, turned_from,
    whole_steps, zeros_of_a_drive,
};
use crate::limits::STEPS_REFINED;
use crate::model::effect::Choice;
use crate::selection::changed_readings::ChangedReadings;
use crate::selection::cost_by_gain::CostByGain;
use crate::selection::evidence::cost_of_choice;
use crate::selection::quick_scores::{QuickScores, ScoredDrive, best_of};
use crate::selection::turned_drives::{Changed, TurnedDrive};

/// Steps from which on no element is turned by more than about an eighth of a radian: a first order then tells which zeros are the best.
/// Set by judgement.
const SMALL_STEPS: u32 = 24;

impl QuickScores<'_> {
    /// The best steps and zeros, if they are worth a fit.
    pub(super) fn steps(&self) -> Vec<Choice> {
        let few = TurnedDrive::all(self, self.stride);
        let rough: Vec<(f64, u32)> = steps_in_a_period()
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|steps| (self.zeros(self.few(), steps, &few).0, steps))
            .collect();
        let all = TurnedDrive::all(self, 1);
        let finer = best_of(rough, STEPS_REFINED).into_par_iter().map(|steps| {
            let choice = self.finer_zeros(steps, &all);
            (self.cost_of_steps(&choice), choice)
        });
        let worth = |(cost, choice): &(f64, Choice)| self.is_worth_a_fit(*cost, choice);
        let worth: Vec<(f64, Choice)> = finer.filter(worth).collect();
        let penalised =
            |(cost, choice)| (cost + 2.0 * cost_of_choice(&choice, self.elements()), choice);
        best_of(worth.into_iter().map(penalised).collect(), 1)
    }

    /// The best zeros for a number of steps by these readings, a common one of the first or one for each drive, with their penalised cost.
    fn zeros(
        &self,
        readings: &[ChangedReadings<'_>],
        steps: u32,
        turned: &[TurnedDrive],
    ) -> (f64, Choice) {
        let first = first_common_zeros().map(|zero| Choice::Steps(steps, vec![zero]));
        let each = self.zero_of_each(readings, steps, turned);
        self.cheapest(readings, steps, turned, first.chain(each))
    }

    /// The same by all readings, with the common zero to as many binary digits as the readings are worth: one that is off by a part of a step rounds that part of all
    /// phases to the wrong side.
    fn finer_zeros(&self, steps: u32, turned: &[TurnedDrive]) -> Choice {
        /// Digits of which the last rounds one of four thousand phases otherwise.
        const MOST_DIGITS: u32 = 12;
        let cheapest =
            |of: &mut dyn Iterator<Item = Choice>| self.cheapest(self.all(), steps, turned, of);
        let common = |zero: u16| Choice::Steps(steps, vec![zero]);
        let mut best = cheapest(&mut first_common_zeros().map(common));
        for digits in FIRST_DIGITS + 1..=MOST_DIGITS {
            let Choice::Steps(_, zeros) = &best.1 else { break };
            let (zero, by) = (zeros[0], 1 << (u16::BITS - digits));
            let beside = [zero, zero.wrapping_sub(by), zero.wrapping_add(by)];
            best = cheapest(&mut beside.into_iter().map(common));
        }
        let each = self.zero_of_each(self.all(), steps, turned);
        cheapest(&mut [best.1].into_iter().chain(each)).1
    }

    /// The best of these zeros for a number of steps by these readings, with its penalised cost.
    fn cheapest(
        &self,
        readings: &[ChangedReadings<'_>],
        steps: u32,
        turned: &[TurnedDrive],
        of: impl Iterator<Item = Choice>,
    ) -> (f64, Choice) {
        let count: usize = readings.iter().map(ChangedReadings::len).sum();
        let share = self.observations.len() as f64 / count as f64;
        let cost = |choice: &Choice| {
            let cost = match Self::is_small(steps, turned) {
                true => self.cost_of_small_steps(turned, choice),
                false => self.quick_cost_of_steps(readings, choice),
            };
            share * cost + 2.0 * cost_of_choice(choice, self.elements())
        };
        of.map(|choice| (cost(&choice), choice))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, Choice::None))
    }

    /// Whether steps are so small that a first order tells what they change.
    fn is_small(steps: u32, turned: &[TurnedDrive]) -> bool {
        steps >= SMALL_STEPS && !turned.is_empty()
    }

    /// The best zero of each drive by itself, if a perfect fit would be worth as many.
    fn zero_of_each(
        &self,
        readings: &[ChangedReadings<'_>],
        steps: u32,
        turned: &[TurnedDrive],
    ) -> Option<Choice> {
        let last = self.drives.iter().map(|drive| drive.number).max().unwrap_or(0);
        let mut of_each = vec![0; last + 1];
        if !self.is_worth_a_fit(0.0, &Choice::Steps(steps, of_each.clone())) {
            return None;
        }
        for drive in &self.drives {
            let turned = turned.get(drive.place).filter(|_| Self::is_small(steps, turned));
            of_each[drive.number] = self.zero_of(drive, &readings[drive.place], steps, turned);
        }
        Some(Choice::Steps(steps, of_each))
    }

    /// The best zero of a drive, by its readings alone, to first order in `turned` if it is given. From one zero to the next higher one an
    /// element is turned by a step, each once.
    fn zero_of(
        &self,
        drive: &ScoredDrive,
        readings: &ChangedReadings<'_>,
        steps: u32,
        turned: Option<&TurnedDrive>,
    ) -> u16 {
        let step_rad = step_rad(steps, self.model.carrier().frequency_ratio);
        let mut zeros = zeros_of_a_drive(&drive.phases_rad, step_rad);
        zeros.sort_unstable();
        let first = zeros.first().copied().unwrap_or(0);
        let turn_of = |phase_rad: &f64| {
            Complex64::cis(whole_steps(*phase_rad, step_rad, first) as f64 * step_rad - phase_rad)
        };
        let turns: Vec<Complex64> = drive.phases_rad.iter().map(turn_of).collect();
        let changes: Vec<Complex64> = turns.iter().map(|turn| turn - 1.0).collect();
        let mut next: Vec<(f64, usize)> = (drive.phases_rad.iter().enumerate())
            .map(|(n, phase_rad)| (turned_from(*phase_rad, step_rad), n))
            .filter(|(from, _)| *from > f64::from(first))
            .collect();
        next.sort_by(|a, b| a.0.total_cmp(&b.0));
        let by_a_step = Complex64::cis(step_rad) - 1.0;
        let mut next = next.into_iter().peekable();
        let mut turning = match turned {
            Some(turned) => Turning::ToFirstOrder(turned.changed(&changes)),
            None => Turning::OfEach(readings.change(&changes)),
        };
        let mut best = (f64::INFINITY, 0);
        for zero in zeros {
            while let Some((_, n)) = next.next_if(|(from, _)| *from <= f64::from(zero)) {
                let by = turns[n] * by_a_step;
                match &mut turning {
                    Turning::ToFirstOrder(changed) => changed.and(n, by),
                    Turning::OfEach(change) => readings.change_further(change, n, by),
                }
            }
            let cost = match &turning {
                Turning::ToFirstOrder(changed) => changed.sums().cost(),
                Turning::OfEach(change) => {
                    let mut sums = CostByGain::default();
                    readings.add_to(&mut sums, change.iter().copied());
                    sums.cost()
                }
            };
            if cost < best.0 {
                best = (cost, zero);
            }
        }
        best.1
    }

    /// The cost of steps to first order in the turns of the elements.
    fn cost_of_small_steps(&self, turned: &[TurnedDrive], choice: &Choice) -> f64 {
        let Choice::Steps(steps, zeros) = choice else { return f64::INFINITY };
        let step_rad = step_rad(*steps, self.model.carrier().frequency_ratio);
        let mut sums = CostByGain::default();
        for drive in &self.drives {
            let zero = zeros.get(drive.number).or(zeros.first()).copied().unwrap_or(0);
            let change =
                |phase: &f64| Complex64::cis(rounded_rad(*phase, step_rad, zero) - phase) - 1.0;
            let changes: Vec<Complex64> = drive.phases_rad.iter().map(change).collect();
            sums.join(&turned[drive.place].changed(&changes).sums());
        }
        sums.cost()
    }

    /// The cost of steps, by all readings.
    fn cost_of_steps(&self, choice: &Choice) -> f64 {
        let turns = self.turns_of_steps(choice);
        let of_drive = |(drive, turns): (&ScoredDrive, &Vec<Complex64>)| drive.changed(turns);
        let changes: Vec<_> = self.drives.par_iter().zip(&turns).map(of_drive).collect();
        self.cost(|drive, i| changes[drive.place][i])
    }

    /// The cost of steps, by some readings.
    fn quick_cost_of_steps(&self, readings: &[ChangedReadings<'_>], choice: &Choice) -> f64 {
        let mut sums = CostByGain::default();
        for (readings, turns) in readings.iter().zip(self.turns_of_steps(choice)) {
            readings.add_to(&mut sums, readings.change(&turns).into_iter());
        }
        sums.cost()
    }

    /// The relative change of each element that steps make, drive by drive.
    fn turns_of_steps(&self, choice: &Choice) -> Vec<Vec<Complex64>> {
        let Choice::Steps(steps, zeros) = choice else { return Vec::new() };
        let step_rad = step_rad(*steps, self.model.carrier().frequency_ratio);
        // Of many elements the turns are looked up: most recur.
        let all_rad = || self.drives.iter().flat_map(|drive| &drive.phases_rad);
        let least_rad = all_rad().copied().fold(f64::INFINITY, f64::min);
        let most_rad = all_rad().copied().fold(f64::NEG_INFINITY, f64::max);
        let first = whole_steps(least_rad, step_rad, 0);
        let count = (whole_steps(most_rad, step_rad, u16::MAX) - first + 1) as usize;
        let turn_of = |whole: i64| Complex64::cis(whole as f64 * step_rad);
        let turns: Option<Vec<Complex64>> = (count < self.drives.len() * self.elements())
            .then(|| (first..).take(count).map(turn_of).collect());
        let of_drive = |drive: &ScoredDrive| {
            let zero = zeros.get(drive.number).or(zeros.first()).copied().unwrap_or(0);
            let of_element = |(phase, turn): (&f64, &Complex64)| {
                let whole = whole_steps(*phase, step_rad, zero);
                let turned = match &turns {
                    Some(turns) => turns[(whole - first) as usize],
                    None => turn_of(whole),
                };
                turned * turn.conj() - 1.0
            };
            drive.phases_rad.iter().zip(&drive.turns).map(of_element).collect()
        };
        self.drives.iter().map(of_drive).collect()
    }
}

/// A drive whose elements are turned one after another.
enum Turning<'d> {
    ToFirstOrder(Changed<'d>),
    /// The change of the pressure at each visit.
    OfEach(Vec<Complex64>),
}
