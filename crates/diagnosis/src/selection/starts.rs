//! Where the search for an effect starts: at its own starts or, where the cost has many minima, at the best of all candidates by a cheap
//! score.
//!
//! The score is the cost after a first-order refit of the gain. The pressure is linear in the elements, so a
//! silent, reversed or exchanged element changes it by what that element contributes.

use fieldgap_acoustics::{Element, Vec3};
use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use crate::effects::phase_quantisation::{rounded_rad, steps_and_zeros};
use crate::fit::joint_fit::Fit;
use crate::limits::{
    FEW_READINGS, HIGHEST_PLANE_M, MOST_IN_A_SET, PLANES, SET_BEAM, START_SHORT_BY,
};
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::{Instance, Setting};
use crate::model::observations::Observations;
use crate::model::pressure::Pressure;
use crate::selection::evidence::cost_of_choice;

/// Step between the heights tried for a plane, in wavelengths: the minima of the score are half a wavelength apart.
const HEIGHT_STEP: f64 = 1.0 / 12.0;

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
            .flat_map(|choice| {
                let begin = move |values| Beginning { choice: choice.clone(), values };
                let starts =
                    if slope_leads { vec![effect.neutral()] } else { effect.starts(context) };
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
    }
}

/// A fit, ready to have its elements changed.
pub(crate) struct QuickScores<'o> {
    observations: &'o Observations,
    fit: &'o Fit,
    model: ForwardModel<'o>,
    drives: Vec<ScoredDrive>,
    /// Cost of the fit itself, over all readings.
    cost: f64,
    /// The first comparison uses one reading in this many.
    stride: usize,
}

struct ScoredDrive {
    number: usize,
    scan: usize,
    drive: usize,
    pressures: Vec<Pressure>,
    /// By element, then visit.
    contributions: Vec<Vec<Complex64>>,
    /// What each element is driven with, rad.
    phases_rad: Vec<f64>,
}

impl<'o> QuickScores<'o> {
    pub fn of(fit: &'o Fit, observations: &'o Observations, context: &'o Context) -> Self {
        let model = fit.model(context);
        let pressures = model.pressures(observations, &fit.nuisance);
        let mut drives = Vec::new();
        for (scan_number, scan) in observations.scans.iter().enumerate() {
            for (number, drive) in scan.drives.iter().enumerate() {
                let nuisance = &fit.nuisance[scan_number];
                drives.push(ScoredDrive {
                    number: drives.len(),
                    scan: scan_number,
                    drive: number,
                    pressures: pressures[scan_number][number].clone(),
                    contributions: model.contributions(&drive.believed, &drive.visits, nuisance),
                    phases_rad: model.phases_rad(&drive.believed),
                });
            }
        }
        let stride = (observations.len() / FEW_READINGS).max(1);
        let mut quick = Self { observations, fit, model, drives, cost: 0.0, stride };
        quick.cost = quick.cost(1, |_, _| Complex64::ZERO);
        quick
    }

    /// Visits one reading in `stride`, drive by drive, with a changed pressure.
    fn evaluate(
        &self,
        stride: usize,
        mut change: impl FnMut(&ScoredDrive, usize) -> Complex64,
        mut see: impl FnMut(Slope),
    ) {
        for drive in &self.drives {
            let scan = &self.observations.scans[drive.scan];
            let observed = &scan.drives[drive.drive];
            let gain = self.fit.nuisance[drive.scan].log_gain.exp();
            for i in (0..observed.visits.len()).step_by(stride) {
                let mut pressure = drive.pressures[i];
                pressure.coherent += change(drive, i);
                let progress = observed.visits[i].progress;
                let expected = self.model.expected_on_scale(&pressure, gain, progress, scan);
                see(Slope {
                    residual: observed.stabilised[i] - expected.value,
                    by_gain: expected.by_log_level,
                    pressure: pressure.coherent,
                });
            }
        }
    }

    /// The cost over one reading in `stride` with changed pressures, after a first-order refit of the gain.
    fn cost(&self, stride: usize, change: impl Fn(&ScoredDrive, usize) -> Complex64) -> f64 {
        let (mut rr, mut rg, mut gg) = (0.0, 0.0, 0.0);
        self.evaluate(stride, change, |Slope { residual, by_gain, .. }| {
            rr += residual * residual;
            rg += residual * by_gain;
            gg += by_gain * by_gain;
        });
        rr - rg * rg / gg.max(f64::MIN_POSITIVE)
    }

    /// Whether a change with this cost over all readings gains about the penalty of its choice.
    fn is_worth_a_fit(&self, cost: f64, choice: &Choice) -> bool {
        0.5 * (self.cost - cost) > cost_of_choice(choice, self.elements()) - START_SHORT_BY
    }

    /// Of the best choices on few readings, those worth a fit to all, the best first.
    fn worth_a_fit(
        &self,
        rough: Vec<(f64, Choice)>,
        count: usize,
        cost: impl Fn(&Choice) -> f64,
    ) -> Vec<Choice> {
        let all = best_of(rough, 4 * count).into_iter().map(|choice| (cost(&choice), choice));
        let worth = all.filter(|(cost, choice)| self.is_worth_a_fit(*cost, choice));
        best_of(worth.collect(), count)
    }

    fn elements(&self) -> usize {
        self.drives[0].contributions.len()
    }

    /// The best set of each size.
    fn sets(&self, times: f64) -> Vec<Choice> {
        let score = |stride: usize, set: &[usize]| {
            self.cost(stride, |drive, i| {
                -times * set.iter().map(|&n| drive.contributions[n][i]).sum::<Complex64>()
            })
        };
        let mut beam: Vec<Vec<usize>> = vec![Vec::new()];
        let mut best = Vec::new();
        for _ in 0..MOST_IN_A_SET.min(self.elements() - 1) {
            let mut grown: Vec<Vec<usize>> = Vec::new();
            for set in &beam {
                for n in (0..self.elements()).filter(|n| !set.contains(n)) {
                    let mut larger = set.clone();
                    larger.push(n);
                    larger.sort_unstable();
                    grown.push(larger);
                }
            }
            grown.sort_unstable();
            grown.dedup();
            let width = if best.is_empty() { SET_BEAM } else { SET_BEAM / 2 };
            let quick = grown.into_iter().map(|set| (score(self.stride, &set), set)).collect();
            beam = best_of(quick, width);
            let finest = beam.iter().take(4).map(|set| (score(1, set), set.clone()));
            best.extend(finest.min_by(|a, b| a.0.total_cmp(&b.0)));
        }
        let choices = best.into_iter().map(|(cost, set)| (cost, Choice::Elements(set)));
        let worth = choices.filter(|(cost, choice)| self.is_worth_a_fit(*cost, choice));
        worth.map(|(_, choice)| choice).collect()
    }

    fn exchanges(&self) -> Vec<Choice> {
        let count = self.elements();
        let score = |stride: usize, a: usize, b: usize| {
            self.cost(stride, |drive, i| {
                let turn = drive.phases_rad[b] - drive.phases_rad[a];
                let (at, back) = (Complex64::cis(turn), Complex64::cis(-turn));
                (at - 1.0) * drive.contributions[a][i] + (back - 1.0) * drive.contributions[b][i]
            })
        };
        let mut rough: Vec<(f64, Choice)> = Vec::new();
        for a in 0..count {
            for b in a + 1..count {
                rough.push((score(self.stride, a, b), Choice::Elements(vec![a, b])));
            }
        }
        self.worth_a_fit(rough, 1, |choice| match choice {
            Choice::Elements(pair) => score(1, pair[0], pair[1]),
            Choice::None | Choice::Law(_) | Choice::Steps(..) => f64::INFINITY,
        })
    }

    fn steps(&self) -> Vec<Choice> {
        let mut rough = Vec::new();
        for (steps, zero) in steps_and_zeros() {
            let cost = self.cost_of_steps(self.stride, steps, zero);
            rough.push((cost, Choice::Steps(steps, zero)));
        }
        self.worth_a_fit(rough, 1, |choice| match choice {
            Choice::Steps(steps, zero) => self.cost_of_steps(1, *steps, *zero),
            Choice::None | Choice::Law(_) | Choice::Elements(_) => f64::INFINITY,
        })
    }

    fn cost_of_steps(&self, stride: usize, steps: u32, zero: u8) -> f64 {
        let frequency_ratio = self.model.carrier().frequency_ratio;
        let rounded = |phase: f64| rounded_rad(phase, steps, zero, frequency_ratio);
        let changes: Vec<Vec<Complex64>> = self
            .drives
            .iter()
            .map(|drive| {
                let mut change = vec![Complex64::ZERO; drive.pressures.len()];
                for (phase, part) in drive.phases_rad.iter().zip(&drive.contributions) {
                    let turn = Complex64::cis(rounded(*phase) - phase) - 1.0;
                    for i in (0..part.len()).step_by(stride) {
                        change[i] += turn * part[i];
                    }
                }
                change
            })
            .collect();
        self.cost(stride, |drive, i| changes[drive.number][i])
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
        let finer = |heights_m: Vec<f64>, stride: usize, count: usize| {
            let finer = heights_m.into_iter().map(|height_m| {
                let (gain, _) = self.reflected(stride, height_m, STEPS);
                (-gain, height_m)
            });
            best_of(finer.collect(), count)
        };
        let few = finer(best_of(quick, 100), self.stride, 36);
        let few = finer(few, (self.stride / 4).max(1), 12);
        let all = few.into_iter().map(|height_m| {
            let (gain, coefficient) = self.reflected(1, height_m, STEPS);
            (-gain, vec![1e3 * height_m, coefficient.re, coefficient.im])
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
        let of_drive = |drive: &ScoredDrive| {
            let observed = &self.observations.scans[drive.scan].drives[drive.drive];
            let nuisance = &self.fit.nuisance[drive.scan];
            let visits = observed.visits.iter().step_by(stride);
            let points_m: Vec<Vec3> =
                visits.map(|visit| self.model.place(visit) + nuisance.shift_m).collect();
            self.model.images(&observed.believed, height_m, &points_m, nuisance)
        };
        self.drives.iter().flat_map(of_drive).collect()
    }
}

/// A residual, the slope of the expected reading by the logarithm of the gain, and the pressure.
struct Slope {
    residual: f64,
    by_gain: f64,
    pressure: Complex64,
}

impl Slope {
    /// The slope of the expected reading by the pressure: its change is the real part of this times a change of pressure.
    fn by_pressure(&self) -> Complex64 {
        self.by_gain / self.pressure.norm_sqr().max(f64::MIN_POSITIVE) * self.pressure.conj()
    }
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

fn best_of<T>(mut quick: Vec<(f64, T)>, count: usize) -> Vec<T> {
    quick.sort_by(|a, b| a.0.total_cmp(&b.0));
    quick.into_iter().take(count).map(|(_, what)| what).collect()
}

/// The effects of a fit and one more.
pub(crate) fn extended(fit: &Fit, effect: &'static dyn Effect, choice: Choice) -> Vec<Instance> {
    let mut instances = fit.instances.clone();
    instances.push(Instance { effect, choice });
    instances
}
