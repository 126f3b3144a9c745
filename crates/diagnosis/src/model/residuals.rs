//! Measured minus expected readings, and how likely they are.
//!
//! Readings and their expected values are brought to the scale on which they scatter by one everywhere
//! ([`NoiseScale`](crate::statistics::noise_scale::NoiseScale)), so that a residual of one is one standard deviation wherever it
//! stands. Where effects change the scatter itself (turbulence, compression), the residual is divided by the new standard deviation
//! and the logarithm of the variance is charged.

use nalgebra::Vector3;

use super::effect::Expected;
use super::forward_model::{ForwardModel, Pressures};
use super::nuisance::Nuisance;
use super::observations::{Observations, ObservedScan, Visit};
use super::pressure::Pressure;
use super::receiver::Scaled;
use crate::limits::LEAST_VARIANCE_RATIO;
use crate::statistics::reading_pairs::without_floor;

/// Residuals of all readings, scan by scan, drive by drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Residuals {
    /// In standard deviations.
    pub scaled: Vec<f64>,
    /// Logarithm of the variance over the scan's scatter's; empty where it is zero everywhere.
    pub log_variances: Vec<f64>,
}

/// Added to a logarithm of a variance ratio so that its root is taken of a positive number: above -ln of the least ratio.
const LIFT: f64 = 7.5;
const _: () = assert!(LEAST_VARIANCE_RATIO >= 1e-3);

impl Residuals {
    /// Twice the negative logarithm of the likelihood, less a constant.
    pub fn cost(&self) -> f64 {
        self.scaled.iter().map(|r| r * r).sum::<f64>() + self.log_variances.iter().sum::<f64>()
    }

    /// The same as numbers whose squares sum up to it and a constant, as least squares wants them.
    pub fn for_least_squares(&self) -> Vec<f64> {
        let charges = self.log_variances.iter().map(|log| (log + LIFT).max(0.0).sqrt());
        self.scaled.iter().copied().chain(charges).collect()
    }
}

impl ForwardModel<'_> {
    /// The residuals of the readings, given their pressures.
    pub fn residuals(
        &self,
        observations: &Observations,
        pressures: &Pressures,
        nuisance: &[Nuisance],
    ) -> Residuals {
        let mut residuals = Residuals::default();
        let count = observations.len();
        residuals.scaled.reserve(count);
        for ((scan, pressures), nuisance) in observations.scans.iter().zip(pressures).zip(nuisance)
        {
            let gain = nuisance.log_gain.exp();
            for (drive, pressures) in scan.drives.iter().zip(pressures) {
                let residual = |index: usize, visit: &Visit, pressure: &Pressure| {
                    let Scaled { value, variance_ratio, .. } =
                        self.expected_on_scale(pressure, gain, visit.progress, scan);
                    ((drive.stabilised[index] - value) / variance_ratio.sqrt(), variance_ratio)
                };
                let first = residuals.scaled.len();
                for (index, (visit, pressure)) in drive.visits.iter().zip(pressures).enumerate() {
                    let (scaled, variance_ratio) = residual(index, visit, pressure);
                    residuals.scaled.push(scaled);
                    if self.changes_scatter() {
                        residuals.log_variances.push(variance_ratio.ln());
                    }
                }
                if self.depends_on_arrival() {
                    let pressures = &pressures[drive.visits.len()..];
                    for (ways, pressures) in drive.otherwise.chunks(2).zip(pressures.chunks(2)) {
                        let index = ways[0].0;
                        let other = |way: usize| residual(index, &ways[way].1, &pressures[way]).0;
                        let scaled = &mut residuals.scaled[first + index];
                        *scaled = of_three_arrivals([*scaled, other(0), other(1)]);
                    }
                }
            }
        }
        residuals
    }

    /// The expected readings, in the order of the observations.
    pub fn expected_readings(
        &self,
        observations: &Observations,
        nuisance: &[Nuisance],
    ) -> Vec<f64> {
        self.expected_with_scatter(observations, nuisance).iter().map(|e| e.reading).collect()
    }

    /// The expected readings and their scatter, in the order of the observations.
    pub fn expected_with_scatter(
        &self,
        observations: &Observations,
        nuisance: &[Nuisance],
    ) -> Vec<Expected> {
        let pressures = self.pressures(observations, nuisance);
        let mut expected = Vec::with_capacity(observations.len());
        for ((scan, pressures), nuisance) in observations.scans.iter().zip(&pressures).zip(nuisance)
        {
            let gain = nuisance.log_gain.exp();
            for (drive, pressures) in scan.drives.iter().zip(pressures) {
                let first = expected.len();
                let of =
                    |visit: &Visit, pressure| self.expected(pressure, gain, visit.progress, scan);
                let (visits, others) = pressures.split_at(drive.visits.len());
                expected.extend(drive.visits.iter().zip(visits).map(|(visit, p)| of(visit, p)));
                // Where it is not known how the robot arrived, the way that fits best.
                for ((index, visit), pressure) in drive.otherwise.iter().zip(others) {
                    let (other, reading) = (of(visit, pressure), drive.readings[*index]);
                    let taken = &mut expected[first + index];
                    if (other.reading - reading).abs() < (taken.reading - reading).abs() {
                        *taken = other;
                    }
                }
            }
        }
        expected
    }

    /// No shift, and the gain of each scan that fits best beside this near field.
    pub fn best_gain(&self, observations: &Observations, near_field: f64) -> Vec<Nuisance> {
        let none = Nuisance { log_gain: 0.0, shift_m: Vector3::zeros(), near_field };
        self.best_gain_beside(observations, &vec![none; observations.scans.len()])
    }

    /// The gain of each scan that fits best beside this shift and near field.
    pub fn best_gain_beside(
        &self,
        observations: &Observations,
        nuisance: &[Nuisance],
    ) -> Vec<Nuisance> {
        let pressures = self.pressures(observations, nuisance);
        let scans = observations.scans.iter().zip(&pressures).zip(nuisance);
        scans
            .map(|((scan, pressures), nuisance)| Nuisance {
                log_gain: best_log_gain(scan, pressures),
                ..*nuisance
            })
            .collect()
    }
}

/// The residual that is as likely as three, one of which is true, each with the same chance.
fn of_three_arrivals(residuals: [f64; 3]) -> f64 {
    let [first, second, third] = residuals;
    let smaller = |a: f64, b: f64| if b.abs() < a.abs() { b } else { a };
    let least = smaller(smaller(first, second), third);
    // Summed relative to the largest term, which would else underflow.
    let share: f64 =
        residuals.iter().map(|r| (0.5 * (least * least - r * r)).exp()).sum::<f64>() / 3.0;
    (least * least - 2.0 * share.ln()).max(0.0).sqrt().copysign(least)
}

/// The gain that brings a scan's pressures nearest to its readings, its logarithm.
fn best_log_gain(scan: &ObservedScan, pressures: &[Vec<Pressure>]) -> f64 {
    let (mut product, mut power) = (0.0, 0.0);
    for (drive, pressures) in scan.drives.iter().zip(pressures) {
        for (reading, pressure) in drive.readings.iter().zip(pressures) {
            let magnitude = pressure.coherent.norm();
            product += magnitude * without_floor(*reading, scan.scatter.floor);
            power += magnitude * magnitude;
        }
    }
    (product / power).ln()
}
