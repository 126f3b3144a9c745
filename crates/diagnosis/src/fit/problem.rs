//! The least-squares problem of a set of effects: residuals and their derivatives at any point.

use fieldgap_acoustics::least_squares::{Known, Linearisation, Parameter as Unknown};
use num_complex::Complex64;
use std::cell::RefCell;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

mod element_waves;

use element_waves::{ChangedWave, ElementWaves};

use crate::fit::directions::{along_element, along_gain, along_pressures, count_of, turned};
use crate::fit::kept_value::kept;
use crate::fit::layout::Layout;
use crate::fit::left::Left;
use crate::fit::slopes::Slopes;
use crate::model::effect::{Context, Stage};
use crate::model::forward_model::{ForwardModel, Pressures};
use crate::model::instance::{Active, Instance};
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::model::phases::PhaseResiduals;
use crate::model::pressure::Pressure;
use crate::model::residuals::Residuals;

/// Share of a parameter's scale that its difference quotient steps: far above rounding, far below curvature.
pub(crate) const DIFFERENCE: f64 = 1e-3;

/// The problem that a search works on.
pub(crate) struct Problem<'o> {
    observations: &'o Observations,
    context: &'o Context,
    /// What its numbers belong to.
    pub layout: Layout<'o>,
    /// The last evaluation.
    last: RefCell<Option<Arc<Evaluation>>>,
}

/// The problem evaluated at a point.
pub(crate) struct Evaluation {
    numbers: Vec<f64>,
    pressures: Pressures,
    /// The same without what makes a reading differ from its own repeat.
    steady: OnceLock<Pressures>,
    /// Measured minus expected readings, in standard deviations.
    pub residuals: Residuals,
    /// The same as least squares wants them.
    pub squared: Vec<f64>,
    /// The slope of each residual, and of each variance term, by its pressure.
    slopes: OnceLock<Vec<Complex64>>,
    /// Each element's part of the pressures.
    contributions: OnceLock<ElementWaves>,
    /// How it changes as the elements lean, per radian about x and about y.
    leaning: OnceLock<Vec<ElementWaves>>,
}

impl<'o> Problem<'o> {
    /// Of a set of effects.
    pub fn new(
        observations: &'o Observations,
        context: &'o Context,
        instances: &'o [Instance],
        values: &[Vec<f64>],
    ) -> Self {
        let layout = Layout::of(observations.scans.len(), context, instances, values);
        Self { observations, context, layout, last: RefCell::new(None) }
    }

    /// The same with the departures of the set-up that are beside other effects.
    pub fn with_departures_beside(self, others: &'o [Instance]) -> Self {
        Self { layout: self.layout.with_departures_beside(others, self.context), ..self }
    }

    fn model(&self, numbers: &[f64]) -> ForwardModel<'o> {
        let active = self
            .layout
            .parts()
            .map(|(instance, range)| Active::new(instance, &numbers[range], self.context));
        ForwardModel::of_active(active, self.context)
    }

    fn pressures(&self, numbers: &[f64]) -> Pressures {
        self.model(numbers).pressures(self.observations, &self.layout.nuisance(numbers))
    }

    fn residuals(&self, numbers: &[f64], pressures: &Pressures) -> Residuals {
        self.model(numbers).residuals(self.observations, pressures, &self.layout.nuisance(numbers))
    }

    /// Evaluates a point.
    pub fn evaluate(&self, numbers: &[f64]) -> Arc<Evaluation> {
        let mut last = self.last.borrow_mut();
        if let Some(evaluation) = last.as_ref().filter(|evaluation| evaluation.numbers == numbers) {
            return Arc::clone(evaluation);
        }
        let pressures = self.pressures(numbers);
        let residuals = self.residuals(numbers, &pressures);
        let evaluation = Arc::new(Evaluation {
            numbers: numbers.to_vec(),
            pressures,
            squared: residuals.for_least_squares(),
            residuals,
            steady: OnceLock::new(),
            slopes: OnceLock::new(),
            contributions: OnceLock::new(),
            leaning: OnceLock::new(),
        });
        *last = Some(Arc::clone(&evaluation));
        evaluation
    }

    /// What is left at an evaluated point by level, of which the readings determine so many numbers.
    pub fn left(&self, evaluation: &Evaluation, freedom: f64) -> Left {
        let Evaluation { numbers, pressures, residuals, .. } = evaluation;
        let nuisance = self.layout.nuisance(numbers);
        let expected = self.model(numbers).received(self.observations, pressures, &nuisance);
        Left::of(self.observations, residuals, &expected, freedom)
    }

    /// The forward model and the nuisance one step from a point along each unknown in turn, with the step.
    pub fn beside<'p>(
        &'p self,
        numbers: &'p [f64],
        unknowns: &'p [Unknown],
    ) -> impl Iterator<Item = (ForwardModel<'o>, Vec<Nuisance>, f64)> + 'p {
        (0..numbers.len()).map(|j| {
            let (beside, step) = self.stepped(numbers, unknowns, j);
            (self.model(&beside), self.layout.nuisance(&beside), step)
        })
    }

    /// A point one step along the `j`th unknown, backwards where it is not plausible forwards; and the step.
    fn stepped(&self, numbers: &[f64], unknowns: &[Unknown], j: usize) -> (Vec<f64>, f64) {
        let mut beside = numbers.to_vec();
        let mut step = DIFFERENCE * unknowns[j].scale;
        beside[j] += step;
        if !self.plausible(&beside) {
            step = -step;
            beside[j] = numbers[j] + step;
        }
        (beside, step)
    }

    /// Residuals at a point; NaN where a parameter is not plausible.
    pub fn at(&self, numbers: &[f64]) -> Vec<f64> {
        match self.plausible(numbers) {
            true => self.evaluate(numbers).squared.clone(),
            false => vec![f64::NAN],
        }
    }

    /// Gives each parameter of the effects the range in which it is plausible. A search that only refuses what is outside makes no step at all where one of
    /// them would leave its range: the others then stay where they began.
    pub fn limit(&self, unknowns: &mut [Unknown]) {
        for (instance, numbers) in self.layout.parts() {
            let ranges = ranges(self.observations, self.context, instance);
            let of_effect = unknowns[numbers].iter_mut().zip(ranges);
            of_effect.for_each(|(unknown, range)| unknown.range = Some(range));
        }
    }

    fn plausible(&self, numbers: &[f64]) -> bool {
        self.layout.parts().all(|(instance, range)| {
            is_plausible(self.observations, self.context, instance, &numbers[range])
        })
    }

    /// Residuals and derivatives. Derivatives by the scans' shifts, and by departures of the set-up but those of single elements, change little
    /// between iterations and are taken from `kept` if it holds them.
    pub fn linearise(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        kept: &mut Option<Vec<Vec<f64>>>,
    ) -> Linearisation {
        let evaluation = self.evaluate(numbers);
        let of = |range| self.columns(numbers, unknowns, range, &evaluation);
        let nuisance = self.layout.first();
        let mut columns = match kept.take().filter(|kept| kept[0].len() == evaluation.squared.len())
        {
            Some(mut columns) => {
                let gains = (0..self.layout.departures().start).step_by(Nuisance::COUNT);
                let of_elements = self.layout.spread_departures().map(|(_, range)| range);
                for range in gains.map(|gain| gain..gain + 1).chain(of_elements) {
                    columns.splice(range.clone(), of(range));
                }
                columns
            }
            None => of(0..nuisance),
        };
        *kept = Some(columns.clone());
        columns.extend(of(nuisance..numbers.len()));
        Linearisation { residuals: evaluation.squared.clone(), columns }
    }

    /// Residuals at a point and derivatives, of which the first are known; `None` if these are not of the same residuals.
    pub fn beside_known<'k>(
        &self,
        known: &'k Slopes,
        numbers: &[f64],
        unknowns: &[Unknown],
    ) -> Option<Known<'k>> {
        let mut columns = known.columns().to_vec();
        let evaluation = self.evaluate(numbers);
        if columns.first()?.len() != evaluation.squared.len() {
            return None;
        }
        columns.extend(self.columns(numbers, unknowns, columns.len()..numbers.len(), &evaluation));
        let linear = Linearisation { residuals: evaluation.squared.clone(), columns };
        Some(Known { linear, products: Some(known.products()) })
    }

    /// Derivatives of the residuals by some of the numbers, at an evaluated point. It may have been evaluated without the last effect, if
    /// that is neutral there.
    pub fn columns(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        range: Range<usize>,
        evaluation: &Evaluation,
    ) -> Vec<Vec<f64>> {
        let base = self.model(numbers);
        let random = self.layout.random_ranges();
        range
            .map(|j| {
                let (beside, step) = self.stepped(numbers, unknowns, j);
                let of_scan = j % Nuisance::COUNT;
                let is_nuisance = j < Nuisance::COUNT * self.observations.scans.len();
                let model = self.model(&beside);
                // Each reading follows its own pressure, and where no speckle changes with it, the pressure's magnitude.
                let by_pressure = !model.depends_on_arrival();
                let by_level = by_pressure && !model.scatters_field();
                if is_nuisance && of_scan == 0 && by_level {
                    let slopes = self.slopes(numbers, evaluation);
                    let column = along_gain(slopes, &evaluation.pressures, j / Nuisance::COUNT);
                    return self.projected(column, evaluation);
                }
                let random = random.iter().find(|range| range.contains(&j));
                let changed = random.map(|range| {
                    let factor = |element: usize| base.change_of_element(element, &model) / step;
                    self.changed_wave(numbers, j, range, factor, evaluation)
                });
                if let Some(changed) = changed.as_ref().filter(|_| by_pressure) {
                    let slopes = self.slopes(numbers, evaluation);
                    let ChangedWave { waves, element, factor } = changed;
                    let column = along_element(slopes, waves, *element, *factor);
                    return self.projected(column, evaluation);
                }
                let effect = self.layout.effect(j);
                let of_field = effect.is_none_or(|effect| effect.facts().stage == Stage::Field);
                let scatters = effect.is_some_and(|effect| effect.scatters_repeats());
                let moves_field = of_field && (!is_nuisance || of_scan != 0);
                let moved = if let Some(ChangedWave { waves, element, factor }) = changed {
                    Some(turned(&evaluation.pressures, waves, element, factor * step))
                } else if moves_field && base.scatters_field() && !scatters {
                    Some(self.moved_as_steady(numbers, &beside, evaluation))
                } else {
                    moves_field.then(|| self.pressures(&beside))
                };
                if let Some(moved) = moved.as_ref().filter(|_| by_level && of_field) {
                    let slopes = self.slopes(numbers, evaluation);
                    return self.projected(
                        along_pressures(slopes, &evaluation.pressures, moved, step),
                        evaluation,
                    );
                }
                let pressures = moved.as_ref().unwrap_or(&evaluation.pressures);
                let moved = self.residuals(&beside, pressures).for_least_squares();
                moved.iter().zip(&evaluation.squared).map(|(m, r)| (m - r) / step).collect()
            })
            .collect()
    }

    /// The pressures beside an evaluated point, as the field without its fluctuation moves: their mean moves so but for the fading, and the
    /// fluctuation hardly, while each field with a fluctuation is the sum of several. It turns with the mean.
    fn moved_as_steady(
        &self,
        numbers: &[f64],
        beside: &[f64],
        evaluation: &Evaluation,
    ) -> Pressures {
        let steady = |numbers: &[f64]| {
            let nuisance = self.layout.nuisance(numbers);
            self.model(numbers).without_fluctuations().pressures(self.observations, &nuisance)
        };
        let mut moved = steady(beside);
        let before = kept(&evaluation.steady, || steady(numbers));
        let there = moved.iter_mut().flatten().flatten();
        let here = before.iter().flatten().flatten();
        let scattered = evaluation.pressures.iter().flatten().flatten();
        for ((moved, before), scattered) in there.zip(here).zip(scattered) {
            let coherent = scattered.coherent + moved.coherent - before.coherent;
            let turn = coherent * scattered.coherent.conj();
            let turn = turn * turn / turn.norm_sqr().max(f64::MIN_POSITIVE);
            let speckle_square = scattered.speckle_square * turn;
            *moved = Pressure { coherent, speckle_square, ..*scattered };
        }
        moved
    }

    /// The slope of each residual, then of each variance term, by its pressure: a change dp changes it by the real part of slope times dp.
    pub fn slopes<'l>(&self, numbers: &[f64], evaluation: &'l Evaluation) -> &'l [Complex64] {
        const LOUDER: f64 = 1e-6;
        kept::<Vec<_>>(&evaluation.slopes, || {
            let mut louder = evaluation.pressures.clone();
            let all = louder.iter_mut().flatten().flatten();
            all.for_each(|pressure| pressure.coherent *= 1.0 + LOUDER);
            let moved = self.residuals(numbers, &louder).by_reading();
            let pressures = evaluation.pressures.iter().flatten().flatten().cycle();
            let mut slopes: Vec<Complex64> = moved
                .iter()
                .zip(&evaluation.residuals.by_reading())
                .zip(pressures)
                .map(|((moved, residual), pressure)| {
                    let power = pressure.coherent.norm_sqr().max(f64::MIN_POSITIVE);
                    pressure.coherent.conj() / power * ((moved - residual) / LOUDER)
                })
                .collect();
            let first = slopes.len() - evaluation.residuals.phases.len();
            let mut of_phases = slopes[first..].iter_mut();
            let scans = evaluation.residuals.phases_of_scans.iter().zip(&evaluation.pressures);
            for (phases, pressures) in scans {
                let of_scan = of_phases.by_ref().zip(pressures.iter().flatten()).enumerate();
                for (reading, (slope, pressure)) in of_scan.take(count_of(pressures)) {
                    let by_pressure =
                        |phases: &PhaseResiduals| phases.by_pressure(reading, pressure);
                    *slope = phases.as_ref().map_or(Complex64::ZERO, by_pressure);
                }
            }
            slopes
        })
    }

    /// Derivatives of the residuals with the reference of the phases and the slow noise of the level fitted anew.
    fn projected(&self, mut column: Vec<f64>, evaluation: &Evaluation) -> Vec<f64> {
        evaluation.residuals.take_slow_noise_out(self.observations, &mut column);
        let mut from = column.len() - evaluation.residuals.phases.len();
        for (phases, pressures) in
            evaluation.residuals.phases_of_scans.iter().zip(&evaluation.pressures)
        {
            let end = from + count_of(pressures);
            if let Some(phases) = phases {
                phases.project(&mut column[from..end]);
            }
            from = end;
        }
        column
    }

    /// Whether a reading depends on the way on which the robot came to it.
    pub fn depends_on_arrival(&self, numbers: &[f64]) -> bool {
        self.model(numbers).depends_on_arrival()
    }

    /// How the pressure of each reading changes by the departures of single elements, one column for each number of [`Layout::random_ranges`]: along the
    /// pressure's own phase the real part, across it the imaginary one.
    pub fn pressures_by_elements(
        &self,
        numbers: &[f64],
        unknowns: &[Unknown],
        evaluation: &Evaluation,
    ) -> Vec<Vec<Complex64>> {
        let base = self.model(numbers);
        let ahead = |pressure: &Pressure| {
            let magnitude = pressure.coherent.norm().max(f64::MIN_POSITIVE);
            pressure.coherent.conj() / magnitude
        };
        let ahead: Vec<Complex64> =
            evaluation.pressures.iter().flatten().flatten().map(ahead).collect();
        let ranges = self.layout.random_ranges();
        let numbered = ranges.iter().flat_map(|range| range.clone().map(move |j| (j, range)));
        numbered
            .map(|(j, range)| {
                let (beside, step) = self.stepped(numbers, unknowns, j);
                let model = self.model(&beside);
                let change = |element: usize| base.change_of_element(element, &model) / step;
                let ChangedWave { waves, element, factor } =
                    self.changed_wave(numbers, j, range, change, evaluation);
                let of_element = waves.iter().flat_map(|drive| &drive[element]);
                of_element.zip(&ahead).map(|(wave, ahead)| wave * factor * ahead).collect()
            })
            .collect()
    }

    /// Magnitude of the pressure of each reading, and the size of the slope of its residual by it.
    pub fn magnitudes(&self, numbers: &[f64], evaluation: &Evaluation) -> Vec<(f64, f64)> {
        let slopes = self.slopes(numbers, evaluation).iter();
        let pressures = evaluation.pressures.iter().flatten().flatten();
        pressures.zip(slopes).map(|(p, slope)| (p.coherent.norm(), slope.norm())).collect()
    }
}

/// Whether an effect's parameters are plausible, and allowed by repeats and dark readings.
pub(crate) fn is_plausible(
    observations: &Observations,
    context: &Context,
    instance: &Instance,
    values: &[f64],
) -> bool {
    let ranges = ranges(observations, context, instance);
    ranges.iter().zip(values).all(|((least, most), value)| (*least..=*most).contains(value))
}

/// In which each of an effect's parameters is plausible, and allowed by repeats and dark readings.
fn ranges(observations: &Observations, context: &Context, instance: &Instance) -> Vec<(f64, f64)> {
    let parameters = instance.effect.parameters_of(&instance.choice);
    let mut ranges: Vec<(f64, f64)> = parameters.iter().map(|p| (p.least, p.most)).collect();
    for scan in &observations.scans {
        let of_scan = instance.effect.most(&scan.scatter, context);
        ranges.iter_mut().zip(of_scan).for_each(|(range, most)| range.1 = range.1.min(most));
    }
    ranges
}

#[cfg(test)]
mod tests;
