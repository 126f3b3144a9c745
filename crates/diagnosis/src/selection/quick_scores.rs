//! What a change of some elements' drives would cost, by a cheap score.
//!
//! The score is the cost after a first-order refit of the gain. The pressure is linear in the elements, so a
//! silent, reversed or exchanged element changes it by what that element contributes.

use std::sync::OnceLock;

use num_complex::Complex64;

use crate::fit::joint_fit::Fit;
use crate::limits::{FEW_READINGS, START_SHORT_BY};
use crate::model::effect::{Choice, Context};
use crate::model::forward_model::ForwardModel;
use crate::model::observations::Observations;
use crate::model::pressure::Pressure;
use crate::selection::changed_readings::ChangedReadings;
use crate::selection::cost_by_gain::{CostByGain, Slope};
use crate::selection::evidence::cost_of_choice;

/// A fit, ready to have its elements changed.
pub(crate) struct QuickScores<'o> {
    pub(super) observations: &'o Observations,
    pub(super) fit: &'o Fit,
    pub(super) model: ForwardModel<'o>,
    pub(super) drives: Vec<ScoredDrive>,
    /// Cost of the fit itself, over all readings.
    cost: f64,
    /// The first comparison uses one reading in this many.
    pub(super) stride: usize,
    /// These readings, drive by drive, and all of them.
    few: OnceLock<Vec<ChangedReadings<'o>>>,
    all: OnceLock<Vec<ChangedReadings<'o>>>,
}

/// A drive, with what its elements add to its readings.
pub(super) struct ScoredDrive {
    /// Its place among the drives that are scored.
    pub place: usize,
    /// Its number among the drives of all scans.
    pub number: usize,
    pub scan: usize,
    pub drive: usize,
    pub pressures: Vec<Pressure>,
    /// By element, then visit.
    pub contributions: Vec<Vec<Complex64>>,
    /// What each element is driven with, rad.
    pub phases_rad: Vec<f64>,
    /// The same as complex numbers.
    pub turns: Vec<Complex64>,
}

impl ScoredDrive {
    /// The change of the pressure at each visit, by a relative change of each element.
    pub fn changed(&self, changes: &[Complex64]) -> Vec<Complex64> {
        let mut change = vec![Complex64::ZERO; self.pressures.len()];
        for (part, by) in self.contributions.iter().zip(changes) {
            change.iter_mut().zip(part).for_each(|(change, part)| *change += by * part);
        }
        change
    }
}

impl<'o> QuickScores<'o> {
    pub fn of(fit: &'o Fit, observations: &'o Observations, context: &'o Context) -> Self {
        let model = fit.model(context);
        let pressures = model.pressures(observations, &fit.nuisance);
        let mut drives = Vec::new();
        for (scan_number, scan) in observations.scans.iter().enumerate() {
            let contributions = model.contributions(&scan.drives, &fit.nuisance[scan_number]);
            for ((number, drive), contributions) in
                scan.drives.iter().enumerate().zip(contributions)
            {
                let phases_rad = model.phases_rad(drive.driven());
                drives.push(ScoredDrive {
                    place: drives.len(),
                    number: drive.number,
                    scan: scan_number,
                    drive: number,
                    pressures: pressures[scan_number][number].clone(),
                    contributions,
                    turns: phases_rad.iter().map(|phase| Complex64::cis(*phase)).collect(),
                    phases_rad,
                });
            }
        }
        let stride = (observations.len() / FEW_READINGS).max(1);
        let (few, all) = Default::default();
        let mut quick = Self { observations, fit, model, drives, cost: 0.0, stride, few, all };
        quick.cost = quick.cost(|_, _| Complex64::ZERO);
        quick
    }

    /// Visits one reading in `stride`, drive by drive, with a changed pressure.
    pub(super) fn evaluate(
        &self,
        stride: usize,
        mut change: impl FnMut(&ScoredDrive, usize) -> Complex64,
        mut see: impl FnMut(Slope),
    ) {
        for drive in &self.drives {
            self.evaluate_drive(drive, stride, |i| change(drive, i), &mut see);
        }
    }

    pub(super) fn evaluate_drive(
        &self,
        drive: &ScoredDrive,
        stride: usize,
        mut change: impl FnMut(usize) -> Complex64,
        mut see: impl FnMut(Slope),
    ) {
        let scan = &self.observations.scans[drive.scan];
        let observed = &scan.drives[drive.drive];
        let gain = self.fit.nuisance[drive.scan].log_gain.exp();
        for i in (0..observed.visits.len()).step_by(stride) {
            let mut pressure = drive.pressures[i];
            pressure.coherent += change(i);
            let progress = observed.visits[i].progress;
            let expected = self.model.expected_on_scale(&pressure, gain, progress, scan);
            let deviation = observed.visits[i].variance.sqrt();
            see(Slope {
                residual: (observed.stabilised[i] - expected.value) / deviation,
                by_gain: expected.by_log_level / deviation,
                pressure: pressure.coherent,
            });
        }
    }

    /// The readings of every drive that the first comparison uses.
    pub(super) fn few(&self) -> &[ChangedReadings<'_>] {
        self.few.get_or_init(|| self.changed_readings(self.stride))
    }

    /// All readings of every drive.
    pub(super) fn all(&self) -> &[ChangedReadings<'_>] {
        self.all.get_or_init(|| self.changed_readings(1))
    }

    fn changed_readings(&self, stride: usize) -> Vec<ChangedReadings<'o>> {
        let of_drive = |drive: &ScoredDrive| {
            let scan = &self.observations.scans[drive.scan];
            let mut slopes = Vec::new();
            self.evaluate_drive(drive, stride, |_| Complex64::ZERO, |slope| slopes.push(slope));
            let visits = scan.drives[drive.drive].visits.iter().step_by(stride);
            let deviations = visits.map(|visit| visit.variance.sqrt());
            let few = |part: &Vec<Complex64>| part.iter().step_by(stride).copied().collect();
            let contributions = drive.contributions.iter().map(few).collect();
            ChangedReadings::of(
                slopes.into_iter().zip(deviations),
                &scan.scale,
                self.fit.nuisance[drive.scan].log_gain.exp(),
                contributions,
            )
        };
        self.drives.iter().map(of_drive).collect()
    }

    /// The cost over all readings with changed pressures, after a first-order refit of the gain.
    pub(super) fn cost(&self, change: impl Fn(&ScoredDrive, usize) -> Complex64) -> f64 {
        let mut sums = CostByGain::default();
        self.evaluate(1, change, |slope| sums.add(slope.residual, slope.by_gain));
        sums.cost()
    }

    /// Whether a change with this cost over all readings gains about the penalty of its choice.
    pub(super) fn is_worth_a_fit(&self, cost: f64, choice: &Choice) -> bool {
        0.5 * (self.cost - cost) > cost_of_choice(choice, self.elements()) - START_SHORT_BY
    }

    /// Of the best choices on few readings, those worth a fit to all, the best first.
    pub(super) fn worth_a_fit(
        &self,
        rough: Vec<(f64, Choice)>,
        count: usize,
        cost: impl Fn(&Choice) -> f64,
    ) -> Vec<Choice> {
        let all = best_of(rough, 4 * count).into_iter().map(|choice| (cost(&choice), choice));
        let worth = all.filter(|(cost, choice)| self.is_worth_a_fit(*cost, choice));
        best_of(worth.collect(), count)
    }

    pub(super) fn elements(&self) -> usize {
        self.drives[0].contributions.len()
    }
}

pub(super) fn best_of<T>(mut quick: Vec<(f64, T)>, count: usize) -> Vec<T> {
    quick.sort_by(|a, b| a.0.total_cmp(&b.0));
    quick.into_iter().take(count).map(|(_, what)| what).collect()
}
