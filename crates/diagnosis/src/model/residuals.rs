//! Measured minus expected readings, and how likely they are.
//!
//! Readings and their expected values are brought to the scale on which they scatter by one everywhere
//! ([`NoiseScale`](crate::statistics::noise_scale::NoiseScale)), so that a residual of one is one standard deviation wherever it
//! stands. Where effects change the scatter itself (turbulence, compression), the residual is divided by the new standard deviation
//! and the logarithm of the variance is charged.

use nalgebra::Vector3;
use std::sync::Arc;

use super::effect::Expected;
use super::forward_model::{ForwardModel, Pressures};
use super::nuisance::Nuisance;
use super::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use super::phases::PhaseResiduals;
use super::pressure::Pressure;
use super::receiver::Scaled;
use crate::limits::LEAST_VARIANCE_RATIO;
use crate::statistics::reading_pairs::without_floor;
use crate::statistics::slow_level::SlowLevel;

/// Residuals of all readings, scan by scan, drive by drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Residuals {
    /// In standard deviations; of a scan with slow noise of its level, what that does not predict.
    pub scaled: Vec<f64>,
    /// The same with that noise in them; empty where no scan has it.
    pub with_slow_noise: Vec<f64>,
    /// The slow noise of each scan's level beside the scatter of its readings.
    pub slow_levels: Vec<Option<Arc<SlowLevel>>>,
    /// Logarithm of the variance over the scan's scatter's; empty where it is zero everywhere.
    pub log_variances: Vec<f64>,
    /// Of the phases, in standard deviations, zero where one says nothing; empty where no scan has phases.
    pub phases: Vec<f64>,
    /// The phases of each scan in full.
    pub phases_of_scans: Vec<Option<PhaseResiduals>>,
}

/// Added to a logarithm of a variance ratio so that its root is taken of a positive number: above -ln of the least ratio.
const LIFT: f64 = 7.5;
const _: () = assert!(LEAST_VARIANCE_RATIO >= 1e-3);

impl Residuals {
    /// Twice the negative logarithm of the likelihood, less a constant: about the number of readings where noise alone is left.
    pub fn cost(&self) -> f64 {
        let of_amplitudes =
            self.scaled.iter().map(|r| r * r).sum::<f64>() + self.log_variances.iter().sum::<f64>();
        match self.phases_of_scans.iter().any(Option::is_some) {
            true => of_amplitudes + self.excess_of_phases(),
            false => of_amplitudes,
        }
    }

    /// The cost less what a scatter larger than the noise adds to it: about the number of readings where a set leaves no more than its own
    /// scatter.
    pub fn chi_square(&self) -> f64 {
        self.cost() - self.log_variances.iter().sum::<f64>().max(0.0)
    }

    /// What the phases add to the cost beyond their noise.
    fn excess_of_phases(&self) -> f64 {
        let of_scan = |phases: &PhaseResiduals| {
            phases.scaled.iter().map(|r| r * r).sum::<f64>() - phases.told() as f64
        };
        self.phases_of_scans.iter().flatten().map(of_scan).sum()
    }

    /// The same as numbers whose squares sum up to it and a constant, as least squares wants them.
    pub fn for_least_squares(&self) -> Vec<f64> {
        self.beside_charges(&self.scaled)
    }

    /// The same with the slow noise in them, where each follows from the pressure of its own reading.
    pub fn by_reading(&self) -> Vec<f64> {
        match self.with_slow_noise.is_empty() {
            true => self.for_least_squares(),
            false => self.beside_charges(&self.with_slow_noise),
        }
    }

    fn beside_charges(&self, scaled: &[f64]) -> Vec<f64> {
        let charges = self.log_variances.iter().map(|log| (log + LIFT).max(0.0).sqrt());
        scaled.iter().copied().chain(charges).chain(self.phases.iter().copied()).collect()
    }

    /// Takes the slow noise out of derivatives of the residuals by reading.
    pub fn take_slow_noise_out(&self, observations: &Observations, derivatives: &mut [f64]) {
        let mut from = 0;
        for (scan, slow_level) in observations.scans.iter().zip(&self.slow_levels) {
            let of_scan = from..from + scan.len();
            from = of_scan.end;
            if let Some(slow_level) = slow_level {
                slow_level.take_out(&mut derivatives[of_scan]);
            }
        }
    }

    /// Takes the slow noise out of the last residuals, those of a scan.
    fn follow(&mut self, scan: &ObservedScan) {
        let from = self.scaled.len() - scan.len();
        self.with_slow_noise.extend(&self.scaled[from..]);
        let mut slow_level = scan.slow_level.clone();
        if let Some(usual) = slow_level.as_mut().filter(|_| !self.log_variances.is_empty()) {
            let ratios: Vec<f64> = self.log_variances[from..].iter().map(|log| log.exp()).collect();
            let beside = Arc::new(usual.beside(&ratios));
            for ((reading, variance), (_, usual)) in beside.variances().zip(usual.variances()) {
                self.log_variances[from + reading] += (variance / usual).ln();
            }
            *usual = beside;
        }
        if let Some(slow_level) = &slow_level {
            slow_level.take_out(&mut self.scaled[from..]);
        }
        self.slow_levels.push(slow_level);
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
        let have_phases = observations.have_phases();
        let have_slow_noise = observations.scans.iter().any(|scan| scan.slow_level.is_some());
        for ((scan, pressures), nuisance) in observations.scans.iter().zip(pressures).zip(nuisance)
        {
            let gain = nuisance.log_gain.exp();
            let way = self.arrival(scan, pressures, gain);
            for (drive, pressures) in scan.drives.iter().zip(pressures) {
                let arrived = arrived(drive, pressures, way);
                for ((visit, pressure), stabilised) in arrived.zip(&drive.stabilised) {
                    let Scaled { value, variance_ratio, .. } =
                        self.expected_on_scale(pressure, gain, visit.progress, scan);
                    let deviation = (variance_ratio * visit.variance).sqrt();
                    residuals.scaled.push((stabilised - value) / deviation);
                    if self.changes_scatter() {
                        residuals.log_variances.push(variance_ratio.ln());
                    }
                }
            }
            if have_slow_noise {
                residuals.follow(scan);
            }
            if have_phases {
                let first = residuals.phases.len();
                let phases = self.phase_residuals(scan, pressures, gain, way);
                match &phases {
                    Some(phases) => {
                        residuals.phases.extend(&phases.scaled);
                        let of_scan = residuals.log_variances.iter_mut().skip(first);
                        of_scan.zip(&phases.log_variances).for_each(|(all, log)| *all += log);
                    }
                    None => residuals.phases.resize(first + scan.len(), 0.0),
                }
                residuals.phases_of_scans.push(phases);
            }
        }
        residuals
    }

    fn phase_residuals(
        &self,
        scan: &ObservedScan,
        pressures: &[Vec<Pressure>],
        gain: f64,
        way: Arrival,
    ) -> Option<PhaseResiduals> {
        scan.phase?;
        let drives = scan.drives.iter().zip(pressures);
        let arrived = drives.flat_map(|(drive, pressures)| arrived(drive, pressures, way));
        let pressures: Vec<&Pressure> = arrived.map(|(_, pressure)| pressure).collect();
        PhaseResiduals::of(scan, &pressures, gain, self.scatters_field())
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
        self.received(observations, &self.pressures(observations, nuisance), nuisance)
    }

    /// The same, given the pressures.
    pub fn received(
        &self,
        observations: &Observations,
        pressures: &Pressures,
        nuisance: &[Nuisance],
    ) -> Vec<Expected> {
        let mut expected = Vec::with_capacity(observations.len());
        for ((scan, pressures), nuisance) in observations.scans.iter().zip(pressures).zip(nuisance)
        {
            let gain = nuisance.log_gain.exp();
            let way = self.arrival(scan, pressures, gain);
            for (drive, pressures) in scan.drives.iter().zip(pressures) {
                let arrived = arrived(drive, pressures, way);
                expected.extend(
                    arrived.map(|(visit, pressure)| {
                        self.expected(pressure, gain, visit.progress, scan)
                    }),
                );
            }
        }
        expected
    }

    /// The pressures times the gain of each scan, as the robot came to each reading, in the order of the observations.
    pub fn levels(&self, observations: &Observations, nuisance: &[Nuisance]) -> Vec<Pressure> {
        let pressures = self.pressures(observations, nuisance);
        let mut levels = Vec::with_capacity(observations.len());
        for ((scan, pressures), nuisance) in observations.scans.iter().zip(&pressures).zip(nuisance)
        {
            let gain = nuisance.log_gain.exp();
            let way = self.arrival(scan, pressures, gain);
            for (drive, pressures) in scan.drives.iter().zip(pressures) {
                let arrived = arrived(drive, pressures, way);
                levels.extend(arrived.map(|(_, pressure)| pressure.times(gain)));
            }
        }
        levels
    }

    /// How the robot came to the readings of a scan outside of rows, by what makes them likelier.
    fn arrival(&self, scan: &ObservedScan, pressures: &[Vec<Pressure>], gain: f64) -> Arrival {
        if !self.depends_on_arrival() {
            return Arrival::default();
        }
        let [mut by_the_other, mut by_the_other_side] = [0.0; 2];
        for (drive, pressures) in scan.drives.iter().zip(pressures) {
            let ways = [Arrival::default(), Arrival { straight: true, from_above: true }];
            let [one, other] = ways.map(|way| arrived(drive, pressures, way));
            let visits = one.zip(other).zip(&drive.stabilised);
            for (((visit, one), (_, other)), stabilised) in visits.filter(|v| !v.0.0.0.is_in_row())
            {
                let cost = |pressure: &Pressure| {
                    let Scaled { value, variance_ratio, .. } =
                        self.expected_on_scale(pressure, gain, visit.progress, scan);
                    (stabilised - value).powi(2) / variance_ratio + variance_ratio.ln()
                };
                let gained = if visit.begins { &mut by_the_other_side } else { &mut by_the_other };
                *gained += cost(one) - cost(other);
            }
        }
        Arrival { straight: by_the_other > 0.0, from_above: by_the_other_side > 0.0 }
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

/// How the robot came to readings outside of rows: by default after a run-up, and from below to the first place.
#[derive(Debug, Clone, Copy, Default)]
struct Arrival {
    /// Straight from the reading before.
    straight: bool,
    /// To the first place from above along x.
    from_above: bool,
}

impl Arrival {
    /// Whether it was the other one of the two ways that a visit outside of rows may have been reached.
    fn is_other(self, visit: &Visit) -> bool {
        if visit.begins { self.from_above } else { self.straight }
    }
}

/// Each visit of a drive with its pressure, as the robot came to it.
fn arrived<'p>(
    drive: &'p ObservedDrive,
    pressures: &'p [Pressure],
    way: Arrival,
) -> impl Iterator<Item = (&'p Visit, &'p Pressure)> {
    let (own, others) = pressures.split_at(drive.visits.len());
    let mut others = others.iter();
    drive.visits.iter().zip(own).map(move |(visit, own)| {
        let other = if visit.is_in_row() { None } else { others.next() };
        (visit, other.filter(|_| way.is_other(visit)).unwrap_or(own))
    })
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
