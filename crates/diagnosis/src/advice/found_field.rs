//! The field that a set of effects expects, as complex pressures with their derivatives: what a map of the field is corrected from.
//!
//! A [`FoundField`] gives, at readings or at any places, the coherent pressure, its derivatives by all that the fit left free, what each
//! element adds to it, and what the receiver makes of a level. A program can thereby let the field depart from the set, which no parameter
//! of the set does.
//!
//! Amplitudes do not show by which phase the whole field of a drive turns. A parameter may turn it far (a height by 0.7
//! radians a millimetre), and a derivative along that turn would make an amplitude of it at second order. Derivatives are therefore given without the turn that
//! a drive's readings have in common.

use std::collections::BTreeMap;

use num_complex::Complex64;

use fieldgap_acoustics::Vec3;

use super::outlook::{PossibleReading, as_observations};
use crate::effect_id::EffectId;
use crate::effects::catalogue;
use crate::fit::joint_fit::{Fit, unknowns};
use crate::fit::problem::{DIFFERENCE, Problem};
use crate::model::effect::{Choice, Context, Effect, Parameter, Search, Stage};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedScan, Visit};
use crate::model::pressure::Pressure;
use crate::statistics::scatter::Scatter;

/// Share of a level that the derivative of a reading steps.
const LEVEL_STEP: f64 = 1e-3;

/// Noise that stands for none, as a share of the largest reading: quotients of noise and level stay numbers.
const SILENT: f64 = 1e-9;

/// Standard deviation of a parameter that has no prior, the logarithm of the gain: any factor.
const UNKNOWN: f64 = 3.0;

/// The moment of the scan that a map is of, 0 at its first reading to 1 at its last: the readings of a drifting rig are on average taken then.
const MOMENT_OF_A_MAP: f64 = 0.5;

/// The field that a set of effects expects.
pub struct FoundField<'f> {
    observations: &'f Observations,
    context: &'f Context,
    fit: &'f Fit,
    model: ForwardModel<'f>,
    /// The scan without noise.
    noiseless: ObservedScan,
    /// Effects that the set does not hold, each with one of its parameters beside its neutral value.
    undetected: Vec<Undetected<'f>>,
    /// How each parameter turns the whole field of a drive, rad for each of its units, by number of the record's drive.
    turns: BTreeMap<usize, Vec<f64>>,
}

/// An effect that could be at work without being named.
struct Undetected<'f> {
    model: ForwardModel<'f>,
    step: f64,
}

/// The field at some readings or places. Levels are in the unit of the readings: a pressure times the gain.
#[derive(Debug, Clone, Default)]
pub struct FieldSamples {
    /// Where the receiver truly is, array's frame, m.
    pub at_m: Vec<Vec3>,
    /// Number of the record's drive.
    pub foci: Vec<usize>,
    /// Coherent level.
    pub levels: Vec<Complex64>,
    /// Derivative of the level by each parameter of the set, then by those of effects that it does not hold: by parameter, then by place. The turn
    /// that all readings of a drive share is left out.
    pub slopes: Vec<Vec<Complex64>>,
    /// What each element adds to the level: by element, then by place.
    pub elements: Vec<Vec<Complex64>>,
    /// The levels with their random part, and the moment of the scan of each.
    speckles: Vec<Pressure>,
    progress: Vec<f64>,
}

impl FieldSamples {
    /// Only some of them, by their numbers.
    pub fn only(&self, kept: &[usize]) -> Self {
        let of = |levels: &Vec<Complex64>| in_order(levels, kept);
        Self {
            at_m: in_order(&self.at_m, kept),
            foci: in_order(&self.foci, kept),
            levels: of(&self.levels),
            slopes: self.slopes.iter().map(of).collect(),
            elements: self.elements.iter().map(of).collect(),
            speckles: in_order(&self.speckles, kept),
            progress: in_order(&self.progress, kept),
        }
    }

    /// How each parameter turns the whole field of each drive, weighed by the power of the levels.
    fn turns(&self) -> BTreeMap<usize, Vec<f64>> {
        let mut turns = BTreeMap::new();
        for &focus in &self.foci {
            turns.entry(focus).or_insert_with(|| {
                let of_drive = || (0..self.foci.len()).filter(|&place| self.foci[place] == focus);
                let power: f64 = of_drive().map(|place| self.levels[place].norm_sqr()).sum();
                let turn = |slopes: &Vec<Complex64>| {
                    let across = of_drive().map(|n| (self.levels[n].conj() * slopes[n]).im);
                    across.sum::<f64>() / power.max(f64::MIN_POSITIVE)
                };
                self.slopes.iter().map(turn).collect()
            });
        }
        turns
    }

    fn without(mut self, turns: &BTreeMap<usize, Vec<f64>>) -> Self {
        for (place, focus) in self.foci.iter().enumerate() {
            let of_drive = turns.get(focus).into_iter().flatten();
            for (slopes, turn) in self.slopes.iter_mut().zip(of_drive) {
                slopes[place] -= Complex64::I * turn * self.levels[place];
            }
        }
        self
    }
}

/// How a parameter of the fit may depart from its value there, before any reading: normal, with mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// Its mean.
    pub mean: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

/// What the receiver makes of a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Received {
    /// The mean reading.
    pub reading: f64,
    /// Its derivative by the level.
    pub slope: f64,
    /// Variance of a reading about it.
    pub variance: f64,
}

impl<'f> FoundField<'f> {
    pub(crate) fn of(observations: &'f Observations, context: &'f Context, fit: &'f Fit) -> Self {
        let scan = &observations.scans[0];
        let mut noiseless = ObservedScan { drives: Vec::new(), dark: Vec::new(), ..scan.clone() };
        let additive = SILENT * context.largest_reading;
        noiseless.scatter = Scatter { share: 0.0, additive, ..scan.scatter.clone() };
        let model = fit.model(context);
        let undetected = undetected(&model, fit, observations, context);
        let turns = BTreeMap::new();
        let mut field = Self { observations, context, fit, model, noiseless, undetected, turns };
        field.turns = field.at_readings().turns();
        field
    }

    /// The effects of the set; none for the set-up as believed.
    pub fn effects(&self) -> Vec<EffectId> {
        self.fit.ids()
    }

    /// What the set leaves of the readings, mean square in standard deviations of their noise.
    pub fn chi_square(&self) -> f64 {
        self.fit.cost / self.observations.len() as f64
    }

    /// The wavenumber, rad/m.
    pub fn wavenumber_rad_m(&self) -> f64 {
        self.model.wavenumber_rad_m(&self.observations.first().believed)
    }

    /// How each parameter of the set may depart from the fit, before any reading. Those of effects that could be at work without being named
    /// follow in all derivatives; they have no departures of their own.
    pub fn departures(&self) -> Vec<Departure> {
        let unknowns = self.unknowns();
        let of = |unknown: &fieldgap_acoustics::least_squares::Parameter| match unknown.prior {
            Some((mean, deviation)) => Departure { mean: mean - unknown.start, deviation },
            None => Departure { mean: 0.0, deviation: UNKNOWN },
        };
        unknowns.iter().map(of).collect()
    }

    /// The field at the driven readings of the record, in the order in which they were taken, without those that stand out.
    pub fn at_readings(&self) -> FieldSamples {
        self.samples(self.observations, &self.as_taken())
    }

    /// These readings, in the same order.
    pub fn readings(&self) -> Vec<f64> {
        let readings = self.observations.readings();
        self.as_taken().into_iter().map(|index| readings[index]).collect()
    }

    /// The numbers of the observations, in the order in which they were taken.
    fn as_taken(&self) -> Vec<usize> {
        let drives = self.observations.scans[0].drives.iter();
        let numbers: Vec<usize> =
            drives.flat_map(|drive| drive.visits.iter().map(|visit| visit.number)).collect();
        let mut order: Vec<usize> = (0..numbers.len()).collect();
        order.sort_unstable_by_key(|&index| numbers[index]);
        order
    }

    /// Places of a map, in their order, in the middle of the scan. Each drive must have readings.
    pub fn at(&self, places: &[PossibleReading]) -> FieldSamples {
        self.at_moment(places, MOMENT_OF_A_MAP)
    }

    /// The same at another moment of the scan, 0 at its first reading to 1 at its last; readings that follow come later.
    pub fn at_moment(&self, places: &[PossibleReading], moment: f64) -> FieldSamples {
        let (observations, order) = as_observations(self.observations, places, moment);
        self.samples(&observations, &order)
    }

    /// The mean reading of a level at one of the samples, with the noise of a reading.
    pub fn received(&self, samples: &FieldSamples, index: usize, level: f64) -> Received {
        self.receive(&self.model, &self.observations.scans[0], samples, index, level)
    }

    /// What the receiver would read without noise.
    pub fn noiseless(&self, samples: &FieldSamples, index: usize, level: f64) -> Received {
        self.receive(&self.model, &self.noiseless, samples, index, level)
    }

    /// Derivatives of the readings of these levels by each parameter, the levels held: not zero for what acts in gain, detector or converter.
    pub fn receiver_slopes(
        &self,
        samples: &FieldSamples,
        levels: &[f64],
        noisy: bool,
    ) -> Vec<Vec<f64>> {
        let scan = if noisy { &self.observations.scans[0] } else { &self.noiseless };
        let read = |model: &ForwardModel<'_>| -> Vec<f64> {
            let each = levels.iter().enumerate();
            each.map(|(index, &level)| self.reading(model, scan, samples, index, level)).collect()
        };
        let base = read(&self.model);
        let unknowns = self.unknowns();
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = self.problem(self.observations);
        let slope = |model: &ForwardModel<'_>, step: f64| -> Vec<f64> {
            read(model).iter().zip(&base).map(|(beside, base)| (beside - base) / step).collect()
        };
        let known = problem.beside(&numbers, &unknowns).map(|(model, _, step)| slope(&model, step));
        let undetected = self.undetected.iter().map(|one| slope(&one.model, one.step));
        known.chain(undetected).collect()
    }

    fn problem<'p>(&'p self, observations: &'p Observations) -> Problem<'p> {
        Problem::new(observations, self.context, &self.fit.instances, &self.fit.values)
    }

    fn unknowns(&self) -> Vec<fieldgap_acoustics::least_squares::Parameter> {
        let Fit { instances, values, spreads, nuisance, .. } = self.fit;
        unknowns(instances, values, spreads, &nuisance.of_first(), self.context)
    }

    fn samples(&self, observations: &Observations, order: &[usize]) -> FieldSamples {
        let nuisance = &self.fit.nuisance[..1];
        let unknowns = self.unknowns();
        let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = self.problem(observations);
        let speckles = in_order(&self.model.levels(observations, nuisance), order);
        let coherent = |speckles: &[Pressure]| -> Vec<Complex64> {
            speckles.iter().map(|pressure| pressure.coherent).collect()
        };
        let levels = coherent(&speckles);
        let slope = |model: &ForwardModel<'_>, nuisance: &[Nuisance], step: f64| {
            let beside = in_order(&model.levels(observations, nuisance), order);
            let pairs = coherent(&beside).into_iter().zip(&levels);
            pairs.map(|(beside, here)| (beside - here) / step).collect()
        };
        let known = problem
            .beside(&numbers, &unknowns)
            .map(|(model, nuisance, step)| slope(&model, &nuisance, step));
        let undetected = self.undetected.iter().map(|one| slope(&one.model, nuisance, one.step));
        let slopes = known.chain(undetected).collect();
        let (mut at_m, mut foci, mut progress) = (Vec::new(), Vec::new(), Vec::new());
        let mut elements = vec![Vec::new(); observations.elements()];
        let gain = nuisance[0].log_gain.exp();
        let drives = &observations.scans[0].drives;
        for (drive, added) in drives.iter().zip(self.model.contributions(drives, &nuisance[0])) {
            at_m.extend(self.model.places(&drive.visits, &nuisance[0]));
            foci.extend(drive.visits.iter().map(|_| drive.focus));
            progress.extend(drive.visits.iter().map(|visit: &Visit| visit.progress));
            for (all, of_drive) in elements.iter_mut().zip(added) {
                let of_drive = of_drive.into_iter().take(drive.visits.len());
                all.extend(of_drive.map(|pressure| gain * pressure));
            }
        }
        let samples = FieldSamples {
            at_m: in_order(&at_m, order),
            foci: in_order(&foci, order),
            progress: in_order(&progress, order),
            elements: elements.iter().map(|element| in_order(element, order)).collect(),
            levels,
            slopes,
            speckles,
        };
        samples.without(&self.turns)
    }

    fn receive(
        &self,
        model: &ForwardModel<'_>,
        scan: &ObservedScan,
        samples: &FieldSamples,
        index: usize,
        level: f64,
    ) -> Received {
        let step = LEVEL_STEP * level.max(LEVEL_STEP * self.context.largest_reading);
        let at = |level: f64| self.reading(model, scan, samples, index, level);
        let expected = model.expected(
            &of_level(&samples.speckles[index], level),
            1.0,
            samples.progress[index],
            scan,
        );
        let deviation = self.observations.scans[0].scale.deviation(expected.reading);
        Received {
            reading: expected.reading,
            slope: (at(level + step) - at((level - step).max(0.0))) / (step + step.min(level)),
            variance: expected.variance_ratio * deviation * deviation,
        }
    }

    fn reading(
        &self,
        model: &ForwardModel<'_>,
        scan: &ObservedScan,
        samples: &FieldSamples,
        index: usize,
        level: f64,
    ) -> f64 {
        let pressure = of_level(&samples.speckles[index], level);
        model.expected(&pressure, 1.0, samples.progress[index], scan).reading
    }
}

/// What could be at work beside a set: smooth effects of the catalogue that act to first order.
fn undetected<'f>(
    model: &ForwardModel<'f>,
    fit: &Fit,
    observations: &Observations,
    context: &'f Context,
) -> Vec<Undetected<'f>> {
    let named = fit.ids();
    let acts = |effect: &&'static dyn Effect| {
        effect.search() == Search::Smooth
            && matches!(effect.facts().stage, Stage::Field | Stage::Gain)
            && !effect.is_defect()
            && !effect.begins_flat(context)
            && !named.contains(&effect.id())
            && effect.can_act(observations)
    };
    let of_effect = |effect: &'static dyn Effect| {
        let choice = effect.choices().into_iter().next().unwrap_or(Choice::None);
        let parameters = effect.parameters_of(&choice);
        let instance = Instance { effect, choice };
        let beside = move |number: usize| {
            let mut values: Vec<f64> = parameters.iter().map(|one| one.neutral).collect();
            let Parameter { scale, most, neutral, .. } = parameters[number];
            let step = if neutral + DIFFERENCE * scale <= most { 1.0 } else { -1.0 };
            let step = step * DIFFERENCE * scale;
            values[number] += step;
            let model = model.and(&instance, &values, context);
            Undetected { model, step }
        };
        (0..parameters.len()).map(beside).collect::<Vec<_>>()
    };
    catalogue().filter(acts).flat_map(of_effect).collect()
}

/// A pressure with another coherent level, its random part kept.
fn of_level(pressure: &Pressure, level: f64) -> Pressure {
    let power = pressure.coherent.norm_sqr();
    let phase = match power > 0.0 {
        true => pressure.coherent / power.sqrt(),
        false => Complex64::ONE,
    };
    Pressure { coherent: level * phase, ..*pressure }
}

fn in_order<T: Clone>(values: &[T], order: &[usize]) -> Vec<T> {
    order.iter().map(|&index| values[index].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, nuisance};
    use fieldgap_acoustics::Excitation;

    /// A higher array turns the field by more than a third of a radian, and its amplitude changes by some per cent.
    #[test]
    fn a_height_changes_amplitudes_to_first_order_however_far_it_turns_the_field() {
        let bench = Bench::new();
        let places = |count: u32| -> Vec<Vec3> {
            let at = |n: u32| {
                let n = f64::from(n);
                Vec3::new(0.01 * (2.4 * n).cos(), 0.01 * (1.7 * n).sin(), 0.09 + 0.0004 * n)
            };
            (0..count).map(at).collect()
        };
        let focused = bench.believed().excitation.clone();
        let observations =
            bench.observations(&[(focused, places(60)), (Excitation::Uniform, places(60))]);
        let fit = Fit::of_nothing(vec![nuisance()]);
        let field = FoundField::of(&observations, &bench.context, &fit);
        let samples = field.at_readings();
        let (height, step_m) = (3, 0.5e-3);
        let mut moved = nuisance();
        moved.shift_m.z = step_m;
        let higher = field.model.levels(&observations, &[moved]);
        let largest = higher.iter().map(|level| level.coherent.norm()).fold(0.0, f64::max);
        let mut turned = 0.0f64;
        for (place, higher) in higher.iter().enumerate() {
            let foretold = samples.levels[place] + step_m * samples.slopes[height][place];
            let missed = (foretold.norm() - higher.coherent.norm()).abs() / largest;
            assert!(missed < 0.01, "{place}: {missed}");
            turned = turned.max((higher.coherent * samples.levels[place].conj()).arg().abs());
        }
        assert!(turned > 0.3, "{turned}");
    }
}
