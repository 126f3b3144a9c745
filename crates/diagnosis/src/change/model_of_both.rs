//! What both records have in common: the model of the first, and its discrepancy at each place.
//!
//! The model of A need not be true; it must give the right signature to a change. It frees the speed of sound, the width of the elements'
//! lobes, and amplitude and phase of each element, whose spreads are held. Where this leaves much, the effect that the readings ask for most
//! is added, twice at most. What is left at a place is the discrepancy there (M. C. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63, 425, 2001):
//! noise of A's reading, and errors of the model that B has too. Taken off B's reading it leaves the change and the noise of both.

use fieldgap_acoustics::Vec3;
use fieldgap_acoustics::least_squares::Stopping;

use crate::change::noise::MostNoise;
use crate::effect_id::EffectId;
use crate::effects::{catalogue, effect};
use crate::fit::joint_fit::{Fit, Start, cost_on, fit};
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{
    CARRIED, COMMON_SPREADS, FEW_READINGS, MOST_ADDED_TO_COMMON, MOST_ELEMENTS, NEAR,
    READINGS_OF_COMMON, WORTH_ADDING_TO_COMMON,
};
use crate::model::effect::{Choice, Common, Context, Search};
use crate::model::forward_model::ForwardModel;
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::model::phases::PhaseMeaning;
use crate::noise::settle::settle_scatter;
use crate::statistics::noise_scale::NoiseScale;
use crate::statistics::scatter::Scatter;
use crate::verdict::gap_size::as_believed;

/// Ratios of the speed of sound from which the model of A is fitted: the cost has other minima beside that of the right speed.
const SPEEDS: [f64; 5] = [0.97, 0.985, 1.0, 1.015, 1.03];

/// When a fit of A stops: its errors are second order in the change.
const STOPPING: Stopping = Stopping { iterations: 10, step: 5e-2, fall: 1e-4, carried: CARRIED };

/// The model of A, fitted to it.
pub(crate) struct ModelOfA {
    fit: Fit,
    /// Cost a reading of the believed set-up, and of the model.
    pub cost_a_reading: [f64; 2],
}

impl ModelOfA {
    /// Fits the model and judges the noise of A beside it.
    pub fn of(observations: &mut Observations, most: Option<MostNoise>, context: &Context) -> Self {
        let believed = as_believed(observations);
        let held = |observations: &mut Observations| {
            most.iter().for_each(|most| most.hold(&mut observations.scans[0]));
        };
        settle_scatter(observations, &ForwardModel::believed(), &believed, context, false);
        held(observations);
        let settled_by = |fitted: &Fit, observations: &mut Observations| {
            // A model far from the readings says nothing about their noise.
            let near =
                cost_on(observations, fitted, context) < NEAR.get() * observations.len() as f64;
            settle_scatter(observations, &fitted.model(context), &fitted.nuisance, context, near);
            held(observations);
        };
        let smooth = best_speed(observations, context);
        let some = observations.thinned(READINGS_OF_COMMON);
        let fitted = with_elements(smooth, &some, context);
        settled_by(&fitted, observations);
        let some = observations.thinned(READINGS_OF_COMMON);
        let mut fitted = again(fitted, &some, context);
        for _ in 0..MOST_ADDED_TO_COMMON {
            let Some(more) = with_one_more(&fitted, &some, context) else { break };
            fitted = more;
        }
        settled_by(&fitted, observations);
        let count = observations.len() as f64;
        let of_believed = Fit::of_nothing(as_believed(observations));
        let cost_a_reading =
            [&of_believed, &fitted].map(|fit| cost_on(observations, fit, context) / count);
        Self { fit: fitted, cost_a_reading }
    }

    /// The effects of the model.
    pub fn effects(&self) -> Vec<EffectId> {
        self.fit.ids()
    }

    /// Natural logarithm of A's reading per unit of the simulation.
    pub fn log_gain(&self) -> f64 {
        self.fit.nuisance[0].log_gain
    }

    /// The nuisance of B, if A's readings times `gain` are of its size: no shift.
    pub fn nuisance(&self, gain: f64) -> Vec<Nuisance> {
        let log_gain = self.log_gain() + gain.ln();
        vec![Nuisance { log_gain, shift_m: Vec3::zeros(), ..self.fit.nuisance[0] }]
    }

    /// What is held in a diagnosis of B. The shift of A's coordinates becomes an offset, so that B's own shift is none.
    pub fn common(&self) -> Common {
        let nuisance = &self.fit.nuisance[0];
        let offset = Instance { effect: effect(EffectId::Offset), choice: Choice::None };
        let shift_mm: Vec<f64> = nuisance.shift_m.iter().map(|m| m * 1e3).collect();
        let fitted = self.fit.instances.iter().cloned().zip(self.fit.values.iter().cloned());
        Common {
            effects: fitted.chain([(offset, shift_mm)]).collect(),
            near_field: nuisance.near_field,
        }
    }

    /// The readings of B less the discrepancy of A at their places, on the scale of the noise of both.
    ///
    /// `a` and `b` are pairs; the readings of A times `gain` are of B's size. `phase` says what phases mean that both have.
    pub fn beside(
        &self,
        a: &Observations,
        b: &Observations,
        gain: f64,
        phase: Option<PhaseMeaning>,
        context: &Context,
    ) -> Observations {
        let [of_a, of_b] = [a, b].map(|observations| &observations.scans[0]);
        let mut scan = of_b.clone();
        let fluctuation = match of_a.scatter.fluctuation > 0.0 {
            true => 0.0,
            false => of_b.scatter.fluctuation,
        };
        let model = self.fit.model(context);
        let pressures = model.pressures(a, &self.fit.nuisance);
        scan.phase = phase;
        if phase.is_some() {
            for ((drive_a, drive), pressures) in
                of_a.drives.iter().zip(&mut scan.drives).zip(&pressures[0])
            {
                // Of the phases in B less those in A, what the model expects is the believed part.
                let expected = pressures.iter().map(|pressure| pressure.coherent.arg());
                drive.believed_rad = expected.take(drive.readings.len()).collect();
                let of_a = drive_a.phases_rad.iter().zip(&drive.believed_rad);
                let corrected = of_a.zip(&drive.phases_rad).map(|((a, model), b)| b - (a - model));
                drive.phases_rad = corrected.collect();
            }
        }
        scan.set_scatter(Scatter {
            share: of_a.scatter.share.hypot(of_b.scatter.share),
            additive: (gain * of_a.scatter.additive).hypot(of_b.scatter.additive),
            fluctuation,
            pairs: [].into(),
            ..of_b.scatter.clone()
        });
        let level_gain = (self.log_gain() + gain.ln()).exp();
        let corrected: Vec<Vec<f64>> = of_a
            .drives
            .iter()
            .zip(&scan.drives)
            .zip(&pressures[0])
            .map(|((drive_a, drive_b), pressures)| {
                let discrepancy = |n: usize| {
                    let progress = drive_a.visits[n].progress;
                    let expected =
                        model.expected_on_scale(&pressures[n], level_gain, progress, &scan);
                    scan.scale.of(gain * drive_a.readings[n]) - expected.value
                };
                (0..drive_b.readings.len())
                    .map(|n| drive_b.stabilised[n] - discrepancy(n))
                    .collect()
            })
            .collect();
        for (drive, corrected) in scan.drives.iter_mut().zip(corrected) {
            drive.readings =
                corrected.iter().map(|value| reading_at(&scan.scale, *value)).collect();
            drive.stabilised = corrected;
        }
        Observations { scans: vec![scan] }
    }
}

/// The reading that is at this place on a scale; zero below it.
fn reading_at(scale: &NoiseScale, value: f64) -> f64 {
    /// Halvings: sixteen digits.
    const HALVINGS: usize = 54;
    let (mut low, mut high) = (0.0, f64::MIN_POSITIVE.max(scale.deviation(0.0)));
    while scale.of(high) < value {
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match scale.of(middle) < value {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// Speed of sound and width of the lobes, from the best of several speeds on few readings.
fn best_speed(observations: &Observations, context: &Context) -> Fit {
    let few = observations.thinned(FEW_READINGS);
    let instances = vec![
        Instance { effect: effect(EffectId::SoundSpeed), choice: Choice::None },
        Instance { effect: effect(EffectId::Directivity), choice: Choice::Law(0) },
    ];
    let from = |speed: f64| {
        let start = Start {
            instances: instances.clone(),
            values: vec![vec![speed], vec![1.0]],
            spreads: vec![f64::NAN; 2],
            nuisance: None,
        };
        fit(&few, context, start, STOPPING)
    };
    let fits = SPEEDS.map(from).into_iter();
    fits.min_by(|one, other| one.penalised.total_cmp(&other.penalised)).expect("there are speeds")
}

/// The same with amplitude and phase of each element free, if there are not too many.
fn with_elements(smooth: Fit, observations: &Observations, context: &Context) -> Fit {
    let count = observations.elements();
    let mut start = Start {
        instances: smooth.instances,
        values: smooth.values,
        spreads: smooth.spreads,
        nuisance: Some(smooth.nuisance),
    };
    if (2..=MOST_ELEMENTS).contains(&count) {
        for (id, spread) in
            [EffectId::ElementGain, EffectId::ElementPhase].into_iter().zip(COMMON_SPREADS)
        {
            start.instances.push(Instance { effect: effect(id), choice: Choice::None });
            start.values.push(vec![0.0; count]);
            start.spreads.push(spread);
        }
    }
    fit(observations, context, start, STOPPING)
}

/// The same fit, with the spreads held, on other readings or with another noise.
fn again(fitted: Fit, observations: &Observations, context: &Context) -> Fit {
    let Fit { instances, values, spreads, nuisance, .. } = fitted;
    let start = Start { instances, values, spreads, nuisance: Some(nuisance) };
    fit(observations, context, start, STOPPING)
}

/// With the effect that the readings ask for most; `None` if none explains enough.
fn with_one_more(fitted: &Fit, observations: &Observations, context: &Context) -> Option<Fit> {
    let count = observations.len() as f64;
    let worth = WORTH_ADDING_TO_COMMON * count;
    if fitted.cost < count {
        return None;
    }
    let scores = ScoreStatistics::of(observations, context, fitted);
    let held = fitted.ids();
    let asked_for = catalogue()
        .filter(|effect| {
            effect.search() == Search::Smooth
                && !held.contains(&effect.id())
                && !effect.is_defect()
                && !effect.scatters_repeats()
                && !effect.begins_flat(context)
                && effect.starts(context).contains(&effect.neutral())
                && effect.can_act(observations)
        })
        .filter_map(|effect| {
            let gained = scores.of_effect(effect, &effect.neutral()).gained_beside(0.02)?;
            Some((gained, effect))
        })
        .filter(|(gained, _)| *gained > worth)
        .max_by(|one, other| one.0.total_cmp(&other.0))?;
    let effect = asked_for.1;
    let choice = effect.choices().swap_remove(0);
    let mut more = fitted.clone();
    more.instances.push(Instance { effect, choice });
    more.values.push(effect.neutral());
    more.spreads.push(f64::NAN);
    Some(again(more, observations, context)).filter(|more| fitted.cost - more.cost > worth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_found_from_its_place_on_the_scale() {
        let scale = NoiseScale::new(0.02, 0.003, 1.0);
        for reading in [1e-5, 2e-3, 0.1, 3.7] {
            let found = reading_at(&scale, scale.of(reading));
            assert!((found / reading - 1.0).abs() < 1e-6, "{found} {reading}");
        }
        assert!(reading_at(&scale, -3.0) < 1e-12);
    }
}
