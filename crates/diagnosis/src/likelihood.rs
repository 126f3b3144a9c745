//! How likely the readings are under a supposition.
//!
//! Readings and their expected values are brought to the scale on which they scatter by one everywhere
//! ([`Scale`](super::scale::Scale)), so that a residual of one is one standard deviation wherever it stands, chi-square means what it
//! says, and a structure in a map of residuals is one. Where a supposition changes the scatter itself (turbulence,
//! compression), the residual is divided by the new one and its logarithm is charged.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::Vector3;

use fieldgap_acoustics::Vec3;

use super::detection::{Detected, rice_mean};
use super::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use super::pair::without_floor;
use super::supposed::{Pressure, Supposed};

/// What is open in every scan, whatever is supposed: the gain, a small shift, and how near the near field is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nuisance {
    /// Logarithm of the reading per unit of the simulation.
    pub log_gain: f64,
    /// Shift of the scan's coordinates, m.
    pub shift_m: Vector3<f64>,
    /// How much of a piston's near field the elements show: simulators leave it out.
    pub near_field: f64,
}

impl Nuisance {
    /// Numbers in it.
    pub const COUNT: usize = 5;

    /// What they are called.
    pub const NAMES: [&str; Self::COUNT] = [
        "the gain",
        "the place along x",
        "the place along y",
        "the place along z",
        "the near field",
    ];

    /// From its numbers: log gain, then x, y, z, then the near field.
    pub fn from_slice(numbers: &[f64]) -> Self {
        let shift_m = Vec3::new(numbers[1], numbers[2], numbers[3]);
        Self { log_gain: numbers[0], shift_m, near_field: numbers[4] }
    }
}

/// Pressures of every reading: by scan, then drive, then visit; after the visits those of how they may have been otherwise,
/// where it matters how the robot came.
pub(super) type Pressures = Vec<Vec<Vec<Pressure>>>;

/// The expected reading, and the variance of a reading about it over that of the scan's scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    pub reading: f64,
    pub variance_ratio: f64,
}

/// The expected reading on the scan's scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaled {
    pub value: f64,
    /// Its slope by the logarithm of the level.
    pub by_log_level: f64,
    /// Variance of a reading about it, over that of the scan's scatter.
    pub variance_ratio: f64,
}

/// Residuals of all readings, scan by scan, drive by drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Residuals {
    /// In standard deviations of what is supposed.
    pub scaled: Vec<f64>,
    /// Logarithm of the variance over the scan's scatter's; empty where it is zero everywhere.
    pub log_variances: Vec<f64>,
}

/// The variance ratio is kept above this: no detector is as quiet as a formula.
const LEAST_RATIO: f64 = 1e-3;

/// Above minus the logarithm of [`LEAST_RATIO`], so that the root below is of a positive number.
const LIFT: f64 = 7.5;

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

/// The pressures under a supposition.
pub(super) fn pressures(
    observations: &Observations,
    supposed: &Supposed,
    nuisance: &[Nuisance],
) -> Pressures {
    observations
        .scans
        .iter()
        .zip(nuisance)
        .map(|(scan, nuisance)| {
            let of_drive = |drive: &ObservedDrive| {
                let at = |visits: &[Visit]| supposed.pressures(&drive.believed, visits, nuisance);
                if !supposed.minds_the_way() {
                    return at(&drive.visits);
                }
                let otherwise = drive.otherwise.iter().map(|(_, visit)| *visit);
                at(&drive.visits.iter().copied().chain(otherwise).collect::<Vec<_>>())
            };
            scan.drives.iter().map(of_drive).collect()
        })
        .collect()
}

impl Supposed {
    /// What the receiver reads of a pressure: gain, drift, quadrature noise, compression, floor, noise in proportion (or that
    /// before compression and floor), full scale, in this order.
    pub fn expected(
        &self,
        pressure: &Pressure,
        gain: f64,
        progress: f64,
        scan: &ObservedScan,
    ) -> Expected {
        let scatter = &scan.scatter;
        let gain = self.gain_at(gain, progress);
        let level = level(pressure, gain);
        // Of magnitudes that are averaged, each has the noise of one.
        let single = scatter.additive * scan.averaged.sqrt();
        if !self.changes_scatter() {
            let reading = rice_mean(level, single);
            return self.cut(Expected { reading, variance_ratio: 1.0 }, scan);
        }
        let noise = single * single;
        let speckle = pressure.speckle_along_and_across().map(|square| gain * gain * square);
        let [along, across] = speckle.map(|square| (noise + square).sqrt());
        let compressed = |reading: f64| match self.saturation.is_finite() {
            true => reading / (1.0 + (reading / self.saturation).powi(2)).sqrt(),
            false => reading,
        };
        let detected = Detected::of(level, along, across);
        let (reading, quadrature) =
            detected.received(self.floor, |reading| with_floor(compressed(reading), self.floor));
        let proportional = match self.share_before_receiver {
            false => scatter.share * reading,
            true => {
                let compressed = compressed(level);
                let steepness = match level > 0.0 {
                    true => (compressed / level).powi(3) * compressed / reading,
                    false => 0.0,
                };
                scatter.share * level * steepness
            }
        };
        // Averaging takes from the noise, and not from what changes more slowly.
        let of_noise = 2.0 * noise / (2.0 * noise + speckle[0] + speckle[1]).max(f64::MIN_POSITIVE);
        let quadrature = quadrature * (1.0 - of_noise * (1.0 - 1.0 / scan.averaged));
        let variance = quadrature + proportional * proportional;
        let variance_ratio = (variance * scan.scale.slope(reading).powi(2)).max(LEAST_RATIO);
        self.cut(Expected { reading, variance_ratio }, scan)
    }

    /// The same on the scan's scale.
    #[inline]
    pub fn expected_on_scale(
        &self,
        pressure: &Pressure,
        gain: f64,
        progress: f64,
        scan: &ObservedScan,
    ) -> Scaled {
        if !self.changes_scatter() && !self.full_scale.is_finite() {
            let level = level(pressure, self.gain_at(gain, progress));
            let (value, by_log_level) = scan.scale.of_level(level);
            return Scaled { value, by_log_level, variance_ratio: 1.0 };
        }
        let Expected { reading, variance_ratio } = self.expected(pressure, gain, progress, scan);
        let by_log_level = reading * scan.scale.slope(reading);
        Scaled { value: scan.scale.of(reading), by_log_level, variance_ratio }
    }

    fn gain_at(&self, gain: f64, progress: f64) -> f64 {
        gain * (1.0 + self.drift * progress).max(1e-3)
    }

    /// What a converter's full scale leaves of readings: those that noise takes beyond it are cut, and those that it takes below are
    /// not. How those that are cut would have scattered says nothing.
    fn cut(&self, expected: Expected, scan: &ObservedScan) -> Expected {
        if !self.full_scale.is_finite() {
            return expected;
        }
        let Expected { reading, variance_ratio } = expected;
        let deviation = scan.scale.deviation(reading) * variance_ratio.sqrt();
        let below = (self.full_scale - reading) / deviation;
        let share_below = 0.5 * libm::erfc(-below * FRAC_1_SQRT_2);
        let density = (-0.5 * below * below).exp() / TAU.sqrt();
        Expected {
            reading: self.full_scale - deviation * (below * share_below + density),
            variance_ratio: 1.0 + share_below * (variance_ratio - 1.0),
        }
    }

    /// Whether it matters how the robot came to a point.
    pub fn minds_the_way(&self) -> bool {
        self.backlash_m != 0.0 || self.lag_s != 0.0
    }

    /// Whether readings scatter otherwise than the scan's scatter says.
    pub fn changes_scatter(&self) -> bool {
        self.turbulence > 0.0 || self.saturation.is_finite() || self.floor > 0.0
    }

    /// The residuals that pressures leave.
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
                if self.minds_the_way() {
                    let pressures = &pressures[drive.visits.len()..];
                    for (ways, pressures) in drive.otherwise.chunks(2).zip(pressures.chunks(2)) {
                        let index = ways[0].0;
                        let other = |way: usize| residual(index, &ways[way].1, &pressures[way]).0;
                        let scaled = &mut residuals.scaled[first + index];
                        *scaled = either_way([*scaled, other(0), other(1)]);
                    }
                }
            }
        }
        residuals
    }
}

/// The magnitude that is heard of a pressure. (The library's norm guards against overflow, at five times the time.)
fn level(pressure: &Pressure, gain: f64) -> f64 {
    pressure.coherent.norm_sqr().sqrt() * gain
}

/// A reading after the floor of the receiver's electronics, which adds in power. (As of the norm, so of the library's hypotenuse.)
fn with_floor(reading: f64, floor: f64) -> f64 {
    (reading * reading + floor * floor).sqrt()
}

/// The residual that is as likely as three, one of which is true, nobody knows which.
fn either_way(residuals: [f64; 3]) -> f64 {
    let least = residuals.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs()));
    let least = least.expect("there are three");
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

/// No shift, and the gain that fits best.
pub(super) fn first_gain(observations: &Observations, supposed: &Supposed) -> Vec<Nuisance> {
    let none = Nuisance { log_gain: 0.0, shift_m: Vector3::zeros(), near_field: 0.0 };
    let at_rest = vec![none; observations.scans.len()];
    let pressures = pressures(observations, supposed, &at_rest);
    observations
        .scans
        .iter()
        .zip(&pressures)
        .map(|(scan, pressures)| Nuisance { log_gain: best_log_gain(scan, pressures), ..none })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::scale::Scale;
    use super::super::scatter::Scatter;
    use super::*;

    /// The mean of normal readings cut at a level, by summing over their density.
    #[test]
    fn a_full_scale_cuts_as_much_of_the_mean_as_the_readings_beyond_it_had() {
        let (share, full_scale) = (0.05, 0.3);
        let scan = ObservedScan {
            drives: Vec::new(),
            scatter: Scatter::default(),
            averaged: 1.0,
            scale: Scale::new(share, 1e-6, 1.0),
            silent: Vec::new(),
        };
        let supposed = Supposed { full_scale, ..Supposed::default() };
        for reading in [0.2, 0.28, 0.3, 0.31, 0.33, 0.6] {
            let deviation = share * reading;
            let (mut sum, mut weights) = (0.0, 0.0);
            for n in -600..=600 {
                let t = 0.01 * f64::from(n);
                let weight = (-0.5 * t * t).exp();
                sum += weight * (reading + t * deviation).min(full_scale);
                weights += weight;
            }
            let cut = supposed.cut(Expected { reading, variance_ratio: 1.0 }, &scan);
            assert!((cut.reading - sum / weights).abs() < 1e-5, "{reading}: {cut:?}");
        }
        let beyond = supposed.cut(Expected { reading: 0.6, variance_ratio: 0.1 }, &scan);
        assert!((beyond.variance_ratio - 1.0).abs() < 1e-6, "{beyond:?}");
    }
}
