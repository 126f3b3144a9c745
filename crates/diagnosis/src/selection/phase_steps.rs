//! The numbers of phase steps, and where drives count them from, that explain most.
//!
//! The zero of a drive matters only by which phases are rounded up and which down, so there are as many zeros as elements. From one to the next one
//! element is turned by a step: all of them are tried.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::effects::phase_quantisation::{
    COMMON_ZEROS, common_zero, step_rad, steps_in_a_period, turned_from, whole_steps,
    zeros_of_a_drive,
};
use crate::limits::STEPS_REFINED;
use crate::model::effect::Choice;
use crate::selection::evidence::cost_of_choice;
use crate::selection::quick_scores::{QuickScores, ScoredDrive, best_of};

impl QuickScores<'_> {
    /// The best steps and zeros, if they are worth a fit.
    pub(super) fn steps(&self) -> Vec<Choice> {
        let rough: Vec<(f64, u32)> = steps_in_a_period()
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|steps| (self.penalised(self.stride, &self.zeros(self.stride, steps)), steps))
            .collect();
        let finer = best_of(rough, STEPS_REFINED).into_par_iter().map(|steps| {
            let choice = self.zeros(1, steps);
            (self.cost_of_steps(1, &choice), choice)
        });
        let worth = |(cost, choice): &(f64, Choice)| self.is_worth_a_fit(*cost, choice);
        let worth: Vec<(f64, Choice)> = finer.filter(worth).collect();
        let penalised =
            |(cost, choice)| (cost + 2.0 * cost_of_choice(&choice, self.elements()), choice);
        best_of(worth.into_iter().map(penalised).collect(), 1)
    }

    /// The best zeros for a number of steps by one reading in `stride`: a common one, or one for each drive.
    fn zeros(&self, stride: usize, steps: u32) -> Choice {
        let common =
            (0..COMMON_ZEROS).map(|number| Choice::Steps(steps, vec![common_zero(number)]));
        let last = self.drives.iter().map(|drive| drive.number).max().unwrap_or(0);
        // A perfect fit would not be worth a zero for each of many drives with few readings.
        let is_worth_it = self.is_worth_a_fit(0.0, &Choice::Steps(steps, vec![0; last + 1]));
        let each = is_worth_it.then(|| {
            let mut of_each = vec![0; last + 1];
            for drive in &self.drives {
                of_each[drive.number] = self.zero_of(drive, stride, steps);
            }
            Choice::Steps(steps, of_each)
        });
        let all = common.chain(each);
        all.map(|choice| (self.penalised(stride, &choice), choice))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(Choice::None, |(_, choice)| choice)
    }

    /// The best zero of a drive, by its readings alone. From one zero to the next higher one an element is turned by a step, each once.
    fn zero_of(&self, drive: &ScoredDrive, stride: usize, steps: u32) -> u16 {
        let step_rad = step_rad(steps, self.model.carrier().frequency_ratio);
        let mut zeros = zeros_of_a_drive(&drive.phases_rad, step_rad);
        zeros.sort_unstable();
        let first = zeros.first().copied().unwrap_or(0);
        let mut change = vec![Complex64::ZERO; drive.pressures.len()];
        let add = |change: &mut [Complex64], turn: Complex64, part: &[Complex64]| {
            for i in (0..part.len()).step_by(stride) {
                change[i] += turn * part[i];
            }
        };
        let turned = |n: usize| {
            let phase_rad = drive.phases_rad[n];
            Complex64::cis(whole_steps(phase_rad, step_rad, first) as f64 * step_rad - phase_rad)
        };
        let mut next: Vec<(f64, usize)> = Vec::with_capacity(drive.phases_rad.len());
        for (n, part) in drive.contributions.iter().enumerate() {
            add(&mut change, turned(n) - 1.0, part);
            next.push((turned_from(drive.phases_rad[n], step_rad), n));
        }
        next.retain(|(from, _)| *from > f64::from(first));
        next.sort_by(|a, b| a.0.total_cmp(&b.0));
        let by_a_step = Complex64::cis(step_rad) - 1.0;
        let mut next = next.into_iter().peekable();
        let mut best = (f64::INFINITY, 0);
        for zero in zeros {
            while let Some((_, n)) = next.next_if(|(from, _)| *from <= f64::from(zero)) {
                add(&mut change, turned(n) * by_a_step, &drive.contributions[n]);
            }
            let cost = self.cost_of_drive(drive, stride, &change);
            if cost < best.0 {
                best = (cost, zero);
            }
        }
        best.1
    }

    /// The cost of steps over one reading in `stride`, scaled to all readings, with the penalty of the choice.
    fn penalised(&self, stride: usize, choice: &Choice) -> f64 {
        let share = self.observations.len() as f64 / self.readings_in(stride) as f64;
        share * self.cost_of_steps(stride, choice) + 2.0 * cost_of_choice(choice, self.elements())
    }

    fn cost_of_steps(&self, stride: usize, choice: &Choice) -> f64 {
        let Choice::Steps(steps, zeros) = choice else { return f64::INFINITY };
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
        let changes: Vec<Vec<Complex64>> = self
            .drives
            .par_iter()
            .map(|drive| {
                let zero = zeros.get(drive.number).or(zeros.first()).copied().unwrap_or(0);
                let mut change = vec![Complex64::ZERO; drive.pressures.len()];
                let of_elements =
                    drive.phases_rad.iter().zip(&drive.turns).zip(&drive.contributions);
                for ((phase, turn), part) in of_elements {
                    let whole = whole_steps(*phase, step_rad, zero);
                    let turned = match &turns {
                        Some(turns) => turns[(whole - first) as usize],
                        None => turn_of(whole),
                    };
                    let turn = turned * turn.conj() - 1.0;
                    for i in (0..part.len()).step_by(stride) {
                        change[i] += turn * part[i];
                    }
                }
                change
            })
            .collect();
        self.cost(stride, |drive, i| changes[drive.place][i])
    }
}
