//! How the waves of single elements change by their departures.
//!
//! A departure of amplitude or phase changes the wave of an element by one factor at all readings. Where an element leans, the factor differs with the
//! direction.

use std::ops::Range;

use num_complex::Complex64;

use super::{Evaluation, Problem};
use crate::fit::kept_value::kept;
use crate::model::effect::PerElement;

/// A wave of each element: by drive over all scans, then element, then visit.
pub(super) type ElementWaves = Vec<Vec<Vec<Complex64>>>;

/// How the wave of one element changes by a unit of one of its departures: by this factor times these waves.
pub(super) struct ChangedWave<'l> {
    pub waves: &'l ElementWaves,
    pub element: usize,
    pub factor: Complex64,
}

impl Problem<'_> {
    /// How a wave changes by the `j`th number, which is in this range of departures; `factor` is that of an element whose whole wave changes by one.
    pub(super) fn changed_wave<'l>(
        &self,
        numbers: &[f64],
        j: usize,
        range: &Range<usize>,
        factor: impl Fn(usize) -> Complex64,
        evaluation: &'l Evaluation,
    ) -> ChangedWave<'l> {
        let elements = self.observations.elements();
        let (kind, element) = ((j - range.start) / elements, (j - range.start) % elements);
        let per_element = self.layout.effect(j).map(|effect| effect.facts().per_element);
        if per_element == Some(PerElement::Axis) {
            let waves = &self.leaning(numbers, range, evaluation)[kind];
            return ChangedWave { waves, element, factor: Complex64::ONE };
        }
        let waves = self.contributions(numbers, evaluation);
        ChangedWave { waves, element, factor: factor(element) }
    }

    fn contributions<'l>(&self, numbers: &[f64], evaluation: &'l Evaluation) -> &'l ElementWaves {
        kept(&evaluation.contributions, || self.element_waves(numbers))
    }

    /// The waves do not depend on one another: all elements lean at once.
    fn leaning<'l>(
        &self,
        numbers: &[f64],
        range: &Range<usize>,
        evaluation: &'l Evaluation,
    ) -> &'l [ElementWaves] {
        /// Far above rounding, far below the curvature of a lobe.
        const LEAN_RAD: f64 = 1e-4;
        kept::<Vec<_>>(&evaluation.leaning, || {
            let elements = self.observations.elements();
            let upright = self.contributions(numbers, evaluation);
            let about_axis = |start: usize| {
                let mut beside = numbers.to_vec();
                beside[start..start + elements].iter_mut().for_each(|angle| *angle += LEAN_RAD);
                let mut waves = self.element_waves(&beside);
                let all = waves.iter_mut().flatten().flatten();
                let before = upright.iter().flatten().flatten();
                all.zip(before).for_each(|(wave, before)| *wave = (*wave - before) / LEAN_RAD);
                waves
            };
            range.clone().step_by(elements).map(about_axis).collect()
        })
    }

    fn element_waves(&self, numbers: &[f64]) -> ElementWaves {
        let model = self.model(numbers);
        let nuisance = self.layout.nuisance(numbers);
        let scans = self.observations.scans.iter().zip(&nuisance);
        scans.flat_map(|(scan, nuisance)| model.contributions(&scan.drives, nuisance)).collect()
    }
}
