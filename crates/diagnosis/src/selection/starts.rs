//! Where the search for an effect starts: at its own starts or, where the cost has many minima, at the best of all candidates by a cheap
//! score.

use fieldgap_acoustics::{Element, Vec3};
use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::effects::lead_screw::LeadScrew;
use crate::effects::reflection::Reflection;
use crate::fit::joint_fit::Fit;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{
    HIGHEST_PLANE_M, LONGEST_LEAD_M, MOST_IN_A_SET, PERIODS, PLANES, SET_BEAM, SHORTEST_LEAD_M,
    START_SHORT_BY,
};
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::instance::{Instance, Setting};
use crate::selection::cost_by_gain::{CostByGain, Slope};
use crate::selection::quick_scores::{QuickScores, ScoredDrive, best_of};

/// Step between the heights tried for a plane, in wavelengths. The coefficient takes up the turn of the phase on the axis; 60 mm beside it and
/// 200 mm from the images the rest is a quarter of a radian in half a wavelength.
const HEIGHT_STEP: f64 = 0.25;

/// How far apart the heights are that a fit is started with, in wavelengths: it finds its way from one to the next.
const HEIGHTS_APART: f64 = 2.0;

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
        Search::Random => vec![plain(vec![0.0; elements])],
        Search::Sets => {
            // A silent element removes its contribution once, a reversed element twice.
            let mut element = [Element::at(0.0, 0.0)];
            let before = element[0].amplitude;
            let choice = Choice::Elements(vec![0]);
            effect.elements(Setting { values: &[], choice: &choice, context }, &mut element);
            let times = (before - element[0].amplitude) / before;
            quick.sets(times).into_iter().map(chosen).collect()
        }
        Search::Exchanges => quick.exchanges().into_iter().map(chosen).collect(),
        Search::Steps => quick.steps().into_iter().map(chosen).collect(),
        Search::Heights => quick.heights(context).into_iter().map(plain).collect(),
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

/// Places along an axis nearer to each other than this are one, m: a robot repeats so well.
const SAME_PLACE_M: f64 = 1e-4;

/// Different places along an axis of which a period is told: two turns of four.
const FEWEST_PLACES: usize = 8;

impl QuickScores<'_> {
    /// The best set of each size.
    fn sets(&self, times: f64) -> Vec<Choice> {
        let exactly = |set: &[usize]| {
            self.cost(|drive, i| {
                -times * set.iter().map(|&n| drive.contributions[n][i]).sum::<Complex64>()
            })
        };
        let mut beam: Vec<Vec<usize>> = vec![Vec::new()];
        let mut best = Vec::new();
        for _ in 0..MOST_IN_A_SET.min(self.elements() - 1) {
            let mut quick: Vec<(f64, Vec<usize>)> =
                beam.par_iter().flat_map_iter(|set| self.sets_with_one_more(set, times)).collect();
            // A set that grew from two smaller ones is there twice.
            quick.sort_by(|a, b| a.1.cmp(&b.1));
            quick.dedup_by(|a, b| a.1 == b.1);
            let width = if best.is_empty() { SET_BEAM } else { SET_BEAM / 2 };
            beam = best_of(quick, width);
            let finest = beam.iter().take(4).map(|set| (exactly(set), set.clone()));
            best.extend(finest.min_by(|a, b| a.0.total_cmp(&b.0)));
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

    /// Height, mm, and coefficient of the planes that explain most.
    fn heights(&self, context: &Context) -> Vec<Vec<f64>> {
        /// Steps of the coefficient: a plane that returns a third of the sound is not small.
        const STEPS: usize = 3;
        let wavelength_m = context.believed.medium.wavelength_m(context.believed.frequency_hz);
        let step_m = HEIGHT_STEP * wavelength_m;
        let still = self.slopes(self.stride, &[], Complex64::ZERO);
        let mut quick: Vec<(f64, f64)> = Vec::new();
        let mut height_m = context.highest_m + step_m;
        while height_m < context.highest_m + HIGHEST_PLANE_M {
            let expected_fall =
                Descent::of(&still, &self.images(self.stride, height_m)).expected_fall();
            quick.push((-expected_fall, height_m));
            height_m += step_m;
        }
        let ways = quick.len() as f64;
        let apart_m = HEIGHTS_APART * wavelength_m;
        let few = apart(quick, apart_m, 2 * PLANES).into_iter().map(|height_m| {
            let (gain, _) = self.reflected(self.stride, height_m, STEPS);
            (-gain, height_m)
        });
        let all = best_of(few.collect(), PLANES).into_iter().map(|height_m| {
            let (gain, coefficient) = self.reflected(1, height_m, STEPS);
            (-gain, Reflection::at_height(height_m, coefficient, context))
        });
        let worth = all.filter(|(cost, _)| -0.5 * cost > ways.ln() - START_SHORT_BY);
        best_of(worth.collect(), PLANES)
    }

    /// Decrease of the cost, and reflection coefficient, of a plane at a height, by Gauss-Newton steps from zero, together with the gain.
    fn reflected(&self, stride: usize, height_m: f64, steps: usize) -> (f64, Complex64) {
        let images = self.images(stride, height_m);
        let at = |coefficient| Descent::of(&self.slopes(stride, &images, coefficient), &images);
        let none = at(Complex64::ZERO);
        let (mut step, none) = (none.step(), none.cost_by_gain());
        let (mut fall, mut coefficient) = (0.0, Complex64::ZERO);
        for _ in 0..steps {
            let next = coefficient + step;
            let there = at(next);
            // A step that increases the cost is halved.
            if none - there.cost_by_gain() <= fall {
                step *= 0.5;
                continue;
            }
            (fall, coefficient, step) = (none - there.cost_by_gain(), next, there.step());
        }
        (fall, coefficient)
    }

    /// Residuals and slopes of one visit in `stride`, drive by drive, with this multiple of the images' pressures.
    fn slopes(&self, stride: usize, images: &[Complex64], coefficient: Complex64) -> Vec<Slope> {
        let mut slopes = Vec::with_capacity(images.len());
        let mut images = images.iter();
        let next = |_: &ScoredDrive, _| images.next().map_or(Complex64::ZERO, |p| coefficient * p);
        self.evaluate(stride, next, |slope| slopes.push(slope));
        slopes
    }

    /// The images of the elements in a plane, at one visit in `stride`, drive by drive.
    fn images(&self, stride: usize, height_m: f64) -> Vec<Complex64> {
        let mut images = Vec::new();
        for of_scan in self.drives.chunk_by(|one, other| one.scan == other.scan) {
            let nuisance = &self.fit.nuisance[of_scan[0].scan];
            let observed =
                |drive: &ScoredDrive| &self.observations.scans[drive.scan].drives[drive.drive];
            let points_m = |drive: &ScoredDrive| -> Vec<Vec3> {
                let visits = observed(drive).visits.iter().step_by(stride);
                visits.map(|visit| self.model.place(visit) + nuisance.shift_m).collect()
            };
            let first_m = points_m(&of_scan[0]);
            // Of many drives at the same few places the elements' parts differ by the drives' phases alone.
            if of_scan.len() > first_m.len() && of_scan.iter().all(|one| points_m(one) == first_m) {
                let first = observed(&of_scan[0]).driven();
                let parts = self.model.contributions_of_images(first, height_m, &first_m, nuisance);
                for drive in of_scan {
                    let turns = drive.turns.iter().zip(&of_scan[0].turns);
                    let turns: Vec<Complex64> =
                        turns.map(|(own, of_first)| own * of_first.conj()).collect();
                    images.extend((0..first_m.len()).map(|i| {
                        parts
                            .iter()
                            .zip(&turns)
                            .map(|(part, turn)| part[i] * turn)
                            .sum::<Complex64>()
                    }));
                }
                continue;
            }
            let drives = of_scan.iter().map(|drive| (observed(drive).driven(), points_m(drive)));
            images.extend(self.model.images(drives, height_m, nuisance));
        }
        images
    }
}

/// The best of some scored heights, m, each so far from those that are better.
fn apart(mut scored: Vec<(f64, f64)>, apart_m: f64, most: usize) -> Vec<f64> {
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<f64> = Vec::new();
    for (_, height_m) in scored {
        if chosen.len() < most && chosen.iter().all(|other| (other - height_m).abs() >= apart_m) {
            chosen.push(height_m);
        }
    }
    chosen
}

/// The normal equations for a gain and the coefficient of images.
struct Descent {
    curvature: Matrix3<f64>,
    downhill: Vector3<f64>,
    cost: f64,
}

impl Descent {
    fn of(slopes: &[Slope], images: &[Complex64]) -> Self {
        let (mut curvature, mut downhill, mut cost) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (slope, image) in slopes.iter().zip(images) {
            let by_image = slope.by_pressure() * image;
            let columns = Vector3::new(slope.by_gain, by_image.re, -by_image.im);
            curvature += columns * columns.transpose();
            downhill += columns * slope.residual;
            cost += slope.residual * slope.residual;
        }
        Self { curvature, downhill, cost }
    }

    /// The decrease of the cost by the gain alone.
    fn by_gain(&self) -> f64 {
        self.downhill[0] * self.downhill[0] / self.curvature[(0, 0)].max(f64::MIN_POSITIVE)
    }

    fn cost_by_gain(&self) -> f64 {
        self.cost - self.by_gain()
    }

    fn whole_step(&self) -> Option<Vector3<f64>> {
        Some(self.curvature.cholesky()?.solve(&self.downhill))
    }

    /// The step of the coefficient.
    fn step(&self) -> Complex64 {
        self.whole_step().map_or(Complex64::ZERO, |step| Complex64::new(step[1], step[2]))
    }

    /// The expected decrease of the cost beyond that by the gain alone, to first order.
    fn expected_fall(&self) -> f64 {
        self.whole_step().map_or(0.0, |step| self.downhill.dot(&step) - self.by_gain())
    }
}

/// The effects of a fit and one more.
pub(crate) fn extended(fit: &Fit, effect: &'static dyn Effect, choice: Choice) -> Vec<Instance> {
    let mut instances = fit.instances.clone();
    instances.push(Instance { effect, choice });
    instances
}
