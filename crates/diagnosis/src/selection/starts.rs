//! Where the search for an effect starts: at its own starts or, where the cost has many minima, at the best of all candidates by a cheap
//! score.

use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::effects::lead_screw::LeadScrew;
use crate::fit::joint_fit::Fit;
use crate::fit::outstanding_elements::weight_in_a_set;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{
    LONGEST_LEAD_M, MOST_IN_A_SMALL_SET, PERIODS, SET_BEAM, SHORTEST_LEAD_M, START_SHORT_BY,
    most_in_a_set,
};
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::instance::Instance;
use crate::model::observations::SAME_PLACE_M;
use crate::selection::cost_by_gain::CostByGain;
use crate::selection::quick_scores::{QuickScores, ScoredDrive, best_of};

/// Where to begin: what is chosen, and the real parameters.
pub(crate) struct Beginning {
    pub choice: Choice,
    pub values: Vec<f64>,
}

/// The starts of an effect to be added to a fit: its own, or the best scored candidates that are worth a fit. If `slope_leads`, the
/// neutral point is the only start.
pub(crate) fn beginnings(
    effect: &'static dyn Effect,
    quick: &QuickScores<'_>,
    scores: &ScoreStatistics<'_>,
    slope_leads: bool,
    context: &Context,
) -> Vec<Beginning> {
    let plain = |values| Beginning { choice: Choice::None, values };
    let chosen = |choice| Beginning { choice, values: Vec::new() };
    let elements = quick.observations.elements();
    match effect.search() {
        Search::Smooth => effect
            .choices()
            .into_iter()
            // Far from the readings, a choice with more parameters follows whatever else is missing, slowly.
            .filter(|choice| {
                slope_leads || effect.parameters_of(choice).len() == effect.parameters().len()
            })
            .flat_map(|choice| {
                let starts =
                    if slope_leads { vec![effect.neutral()] } else { effect.starts(context) };
                let mut starts: Vec<Vec<f64>> =
                    starts.into_iter().map(|values| effect.carried(values, &choice)).collect();
                starts.dedup();
                let begin = move |values| Beginning { choice: choice.clone(), values };
                starts.into_iter().map(begin)
            })
            .collect(),
        Search::Random => vec![plain(effect.no_departures(elements))],
        Search::Sets => {
            let times = 1.0 - weight_in_a_set(effect, context);
            quick.sets(times).into_iter().map(chosen).collect()
        }
        Search::Exchanges => quick.exchanges().into_iter().map(chosen).collect(),
        Search::Steps => quick.steps().into_iter().map(chosen).collect(),
        Search::Heights => quick.heights(context).into_iter().map(plain).collect(),
        Search::Walls => quick.walls(context).into_iter().map(plain).collect(),
        Search::Objects => quick.objects(context).into_iter().map(plain).collect(),
        Search::Periods => periods(scores),
    }
}

/// The axes and periods along them for which the readings ask most, to first order, with the errors that they ask for.
fn periods(scores: &ScoreStatistics<'_>) -> Vec<Beginning> {
    let shifts = scores.shift_columns();
    let mut found: Vec<(f64, Choice, Vec<f64>)> = Vec::new();
    let mut ways = 0.0;
    for (axis, shift) in shifts.iter().enumerate() {
        let drives = scores.observations.scans.iter().flat_map(|scan| &scan.drives);
        let along_m: Vec<f64> =
            drives.flat_map(|drive| drive.visits.iter().map(|visit| visit.at_m[axis])).collect();
        for turns_per_m in turns_along(&along_m) {
            let wave = |shape: fn(f64) -> f64| -> Vec<f64> {
                let places = along_m.iter().cycle().map(|m| shape(TAU * turns_per_m * m));
                shift.iter().zip(places).map(|(by_shift, shape)| by_shift * shape).collect()
            };
            let score = scores.of_columns(&[wave(f64::sin), wave(f64::cos)]);
            let (Some(gained), Some(curvature)) = (score.gained(), score.curvature.cholesky())
            else {
                continue;
            };
            let asked_m = curvature.solve(&score.downhill);
            let (choice, values) = LeadScrew::along(axis, [asked_m[0], asked_m[1]], turns_per_m);
            found.push((-gained, choice, values));
            ways += 1.0;
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let worth = found.into_iter().filter(|(cost, ..)| -0.5 * cost > f64::ln(ways) - START_SHORT_BY);
    worth.take(PERIODS).map(|(_, choice, values)| Beginning { choice, values }).collect()
}

/// Turns for each metre that an error along these places may have, half a turn over all of them apart. Of few different places none is told.
pub(crate) fn turns_along(along_m: &[f64]) -> Vec<f64> {
    let mut places = along_m.to_vec();
    places.sort_by(f64::total_cmp);
    places.dedup_by(|one, other| (*one - *other).abs() < SAME_PLACE_M);
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
    if places.len() < FEWEST_PLACES {
        return Vec::new();
    }
    let turns = (1..).map(|n| 0.5 * f64::from(n) / (last - first).max(LONGEST_LEAD_M));
    turns
        .skip_while(|turns| *turns < 1.0 / LONGEST_LEAD_M)
        .take_while(|turns| *turns <= 1.0 / SHORTEST_LEAD_M)
        .collect()
}

/// Different places along an axis of which a period is told: two turns of four.
const FEWEST_PLACES: usize = 8;

impl QuickScores<'_> {
    /// The best set of each small size, and the best of all larger ones.
    fn sets(&self, times: f64) -> Vec<Choice> {
        let exactly = |set: &[usize]| {
            self.cost(|drive, i| {
                -times * set.iter().map(|&n| drive.contributions[n][i]).sum::<Complex64>()
            })
        };
        let mut beam: Vec<Vec<usize>> = vec![Vec::new()];
        let mut best: Vec<(f64, Vec<usize>)> = Vec::new();
        for size in 1..=most_in_a_set(self.elements()).min(self.elements() - 1) {
            let mut quick: Vec<(f64, Vec<usize>)> =
                beam.par_iter().flat_map_iter(|set| self.sets_with_one_more(set, times)).collect();
            // A set that grew from two smaller ones is there twice.
            quick.sort_by(|a, b| a.1.cmp(&b.1));
            quick.dedup_by(|a, b| a.1 == b.1);
            let width = match size {
                1 => SET_BEAM,
                2..=MOST_IN_A_SMALL_SET => SET_BEAM / 2,
                _ => SET_BEAM / 8,
            };
            beam = best_of(quick, width);
            let finest = beam.iter().take(4).map(|set| (exactly(set), set.clone()));
            let Some(finest) = finest.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            if size > MOST_IN_A_SMALL_SET {
                // One more of the elements must be worth its choice.
                let gained = best.last().map_or(0.0, |smaller| 0.5 * (smaller.0 - finest.0));
                if gained < f64::ln(self.elements() as f64) {
                    break;
                }
                best.truncate(MOST_IN_A_SMALL_SET);
            }
            best.push(finest);
        }
        let choices = best.into_iter().map(|(cost, set)| (cost, Choice::Elements(set)));
        let worth = choices.filter(|(cost, choice)| self.is_worth_a_fit(*cost, choice));
        worth.map(|(_, choice)| choice).collect()
    }

    /// A set with each other element, and what it costs on few readings.
    fn sets_with_one_more(&self, set: &[usize], times: f64) -> Vec<(f64, Vec<usize>)> {
        let mut changes = vec![Complex64::ZERO; self.elements()];
        set.iter().for_each(|&n| changes[n] = Complex64::new(-times, 0.0));
        let before: Vec<_> = self.few().iter().map(|readings| readings.change(&changes)).collect();
        let others = (0..self.elements()).filter(|n| !set.contains(n));
        let with = |n: usize| {
            let mut sums = CostByGain::default();
            for (readings, before) in self.few().iter().zip(&before) {
                let parts = before.iter().zip(readings.of_element(n));
                readings.add_to(&mut sums, parts.map(|(before, part)| before - times * part));
            }
            let mut larger = set.to_vec();
            larger.push(n);
            larger.sort_unstable();
            (sums.cost(), larger)
        };
        others.map(with).collect()
    }

    fn exchanges(&self) -> Vec<Choice> {
        let count = self.elements();
        let turn = |drive: &ScoredDrive, a: usize, b: usize| drive.turns[b] * drive.turns[a].conj();
        let exactly = |a: usize, b: usize| {
            self.cost(|drive, i| {
                let turn = turn(drive, a, b);
                (turn - 1.0) * drive.contributions[a][i]
                    + (turn.conj() - 1.0) * drive.contributions[b][i]
            })
        };
        let quickly = |a: usize, b: usize| {
            let mut sums = CostByGain::default();
            for (drive, readings) in self.drives.iter().zip(self.few()) {
                let turn = turn(drive, a, b);
                let (by_a, by_b) = (turn - 1.0, turn.conj() - 1.0);
                let parts = readings.of_element(a).iter().zip(readings.of_element(b));
                readings.add_to(&mut sums, parts.map(|(a, b)| by_a * a + by_b * b));
            }
            (sums.cost(), Choice::Elements(vec![a, b]))
        };
        let rough = (0..count)
            .into_par_iter()
            .flat_map_iter(|a| (a + 1..count).map(move |b| quickly(a, b)))
            .collect();
        self.worth_a_fit(rough, 1, |choice| match choice {
            Choice::Elements(pair) => exactly(pair[0], pair[1]),
            Choice::None | Choice::Law(_) | Choice::Steps(..) => f64::INFINITY,
        })
    }
}

/// The effects of a fit and one more.
pub(crate) fn extended(fit: &Fit, effect: &'static dyn Effect, choice: Choice) -> Vec<Instance> {
    let mut instances = fit.instances.clone();
    instances.push(Instance { effect, choice });
    instances
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation, Vec3};

    use super::*;
    use crate::effect_id::EffectId;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, nuisance};
    use crate::model::forward_model::ForwardModel;

    /// Of 72 elements up to six are looked for.
    #[test]
    fn a_large_array_may_have_more_silent_elements_than_a_small_one() {
        let bench = Bench::of(Array::square(9, 8, 10e-3).expect("not empty"), Excitation::Uniform);
        let place = |n: usize| Vec3::new((n % 20) as f64 - 9.5, (n / 20 % 20) as f64 - 9.5, 0.0);
        let height_m = |n: usize| if n < 400 { 0.06 } else { 0.1 };
        let places = (0..800).map(|n| place(n) * 5e-3 + Vec3::z() * height_m(n)).collect();
        let mut observations = bench.observations(&[(Excitation::Uniform, places)]);
        for silent in [vec![17, 50], vec![4, 17, 31, 46, 50, 71]] {
            let choice = Choice::Elements(silent.clone());
            let instance = Instance { effect: effect(EffectId::DeadElements), choice };
            let causes = ForwardModel::of(&[instance], &[vec![]], &bench.context);
            let readings = causes.expected_readings(&observations, &[nuisance()]);
            let scan = &mut observations.scans[0];
            scan.drives[0].stabilised =
                readings.iter().map(|level| scan.scale.of(*level)).collect();
            scan.drives[0].readings = readings;
            let fit = Fit::of_nothing(vec![nuisance()]);
            let quick = QuickScores::of(&fit, &observations, &bench.context);
            let sets = quick.sets(1.0);
            let found = |set: &Choice| matches!(set, Choice::Elements(set) if *set == silent);
            assert!(sets.iter().any(found), "{silent:?}: {sets:?}");
            assert!(sets.len() <= MOST_IN_A_SMALL_SET + 1, "{sets:?}");
        }
    }
}
