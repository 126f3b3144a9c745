//! Measured minus expected phases, in standard deviations.
//!
//! Of a reading m with the phase φ, expected at the phase θ, the residual is 2 m sin((φ - θ)/2) over its standard deviation. Near zero it is
//! the quadrature m sin(φ - θ). Its square is 2 m² (1 - cos(φ - θ)), which is the likelihood of a phase beside a known amplitude (von Mises's
//! distribution; K. V. Mardia and P. E. Jupp, *Directional Statistics*, 2000, section 3.5), so that half a turn is no agreement. The variance
//! is b² + (s m)²: b is the quadratures' noise, s the noise of the phase itself. It is that of the measured level, so that no set of effects
//! changes the weights, unless its field fluctuates.
//!
//! The phase of the reference is not known, and it wanders. It is [taken out](super::wandering_reference) of the residuals and of their derivatives, so that no
//! fit has it among its numbers.

use std::collections::HashMap;

use num_complex::Complex64;

use super::observations::{ObservedDrive, ObservedScan};
use super::pressure::Pressure;
use super::wandering_reference::{ReferenceMotion, Turn, WanderingReference};
use crate::statistics::phase_noise::{Difference, PhaseNoise, THIRD, third_difference, wrapped};
use crate::statistics::reference_motion::{RepeatedPhase, motion_of_repeats};

/// Level, in quadratures' standard deviations, below which a phase says nothing: there its distribution is far from normal.
const LEAST_LEVEL: f64 = 3.0;

/// What is known of the phases of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PhaseMeaning {
    /// Standard deviation of the phases' own noise, rad.
    pub noise: PhaseNoise,
    /// Standard uncertainty of the reference's drift over the scan as the record states it, rad.
    pub drift_u_rad: f64,
    /// Standard deviation of the reference's motion over the scan beside a steady drift, rad: the same, or less where repeats show less.
    pub moves_rad: f64,
    /// Whether the reference starts anew with each drive.
    pub each_drive: bool,
}

impl PhaseMeaning {
    fn motion(&self) -> ReferenceMotion {
        ReferenceMotion { drift_rad: self.drift_u_rad, moves_rad: self.moves_rad }
    }
}

/// The phases of one scan beside expected pressures.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PhaseResiduals {
    /// The residuals, in the order of the readings; zero where a phase says nothing.
    pub scaled: Vec<f64>,
    /// Slope of each by its phase difference.
    by_phase: Vec<f64>,
    /// One for each stretch with a constant of its own.
    references: Vec<WanderingReference>,
    /// Natural logarithm of the variance over that of the readings' noise; empty where the field does not fluctuate.
    pub log_variances: Vec<f64>,
}

impl PhaseResiduals {
    /// Of a scan beside the pressures of its readings, which may fluctuate; `None` where the scan has no phases.
    pub fn of(
        scan: &ObservedScan,
        pressures: &[&Pressure],
        gain: f64,
        fluctuates: bool,
    ) -> Option<Self> {
        let meaning = scan.phase.as_ref()?;
        let mut all = Self {
            scaled: vec![0.0; pressures.len()],
            by_phase: vec![0.0; pressures.len()],
            ..Self::default()
        };
        let mut turns = Vec::new();
        let mut readings = 0..;
        for drive in &scan.drives {
            for (index, (visit, reading)) in drive.visits.iter().zip(&mut readings).enumerate() {
                let pressure = pressures[reading];
                let mut weight = weight(scan, drive, index);
                if fluctuates {
                    let across = gain * gain * pressure.speckle_along_and_across()[1];
                    let ratio = 1.0 + across / variance(scan, drive, index);
                    all.log_variances.push(if weight > 0.0 { ratio.ln() } else { 0.0 });
                    weight /= ratio.sqrt();
                }
                if weight > 0.0 {
                    let size = pressure.coherent.norm().max(f64::MIN_POSITIVE);
                    let turn =
                        Complex64::cis(drive.phases_rad[index]) * pressure.coherent.conj() / size;
                    turns.push(Turn { reading, turn, weight, progress: visit.progress });
                }
            }
            if meaning.each_drive {
                all.follow(std::mem::take(&mut turns), meaning.motion());
            }
        }
        if !meaning.each_drive {
            all.follow(turns, meaning.motion());
        }
        Some(all)
    }

    /// The residuals of a stretch with one constant.
    fn follow(&mut self, turns: Vec<Turn>, motion: ReferenceMotion) {
        let Self { scaled, by_phase, references, .. } = self;
        let reference = WanderingReference::along(turns, motion, |reading, residual, slope| {
            scaled[reading] = residual;
            by_phase[reading] = slope;
        });
        references.push(reference);
    }

    /// The difference of each phase that says something, rad, with its weight.
    pub fn weighted_differences_rad(&self) -> impl Iterator<Item = (f64, f64)> {
        let both = self.scaled.iter().zip(&self.by_phase).filter(|(_, slope)| **slope != 0.0);
        both.map(|(scaled, slope)| {
            let half = 0.5 * scaled;
            (half * half + slope * slope, 2.0 * half.atan2(*slope))
        })
    }

    /// How many phases say something.
    pub fn told(&self) -> usize {
        self.by_phase.iter().filter(|slope| **slope != 0.0).count()
    }

    /// How each residual changes with the pressure of its reading, the reference held: by the real part of this times the change.
    pub fn by_pressure(&self, reading: usize, pressure: &Pressure) -> Complex64 {
        // The difference of phases falls by the imaginary part of the relative change.
        let power = pressure.coherent.norm_sqr().max(f64::MIN_POSITIVE);
        Complex64::I * self.by_phase[reading] * pressure.coherent.conj() / power
    }

    /// Takes the reference out of derivatives of the residuals.
    pub fn project(&self, derivatives: &mut [f64]) {
        self.references.iter().for_each(|reference| reference.take_out(derivatives));
    }
}

/// Variance of the quadrature of a reading.
fn variance(scan: &ObservedScan, drive: &ObservedDrive, index: usize) -> f64 {
    let noise_rad = scan.phase.map_or(0.0, |phase| phase.noise.rad);
    let (additive, of_phase) = (scan.scatter.additive, noise_rad * drive.readings[index]);
    drive.visits[index].variance * (additive * additive + of_phase * of_phase)
}

/// Whether the phase of a reading says something.
pub(crate) fn tells_phase(scan: &ObservedScan, drive: &ObservedDrive, index: usize) -> bool {
    let least = LEAST_LEVEL * scan.scatter.additive * drive.visits[index].variance.sqrt();
    drive.phases_rad.get(index).is_some_and(|phase| phase.is_finite())
        && drive.readings[index] > least
}

/// The reading over the standard deviation of its quadrature; zero where its phase says nothing.
fn weight(scan: &ObservedScan, drive: &ObservedDrive, index: usize) -> f64 {
    match tells_phase(scan, drive, index) {
        true => drive.readings[index] / variance(scan, drive, index).sqrt(),
        false => 0.0,
    }
}

/// The noise of a scan's phases beyond that of the quadratures, and the standard deviation of the motion of its reference over the scan, rad.
pub(crate) fn noise_and_moves_rad(
    scan: &ObservedScan,
    PhaseMeaning { drift_u_rad, .. }: PhaseMeaning,
) -> (PhaseNoise, f64) {
    let (mut repeats, mut neighbours) = (Vec::new(), Vec::new());
    for drive in &scan.drives {
        let of_quadratures = |index: usize| {
            let relative = scan.scatter.additive / drive.readings[index];
            drive.visits[index].variance * relative * relative
        };
        repeats.extend(repeated_phases(scan, drive, of_quadratures));
        neighbours.extend(differences_of_neighbours(scan, drive, of_quadratures));
    }
    let (drift_rad, moves_rad) = motion_of_repeats(&repeats, drift_u_rad);
    let difference = |pair: RepeatedPhase| {
        let left_rad = pair.difference_rad - drift_rad * pair.apart();
        let of_motion = 0.5 * moves_rad * moves_rad * pair.apart();
        (0.5 * left_rad * left_rad, pair.quadratures + of_motion)
    };
    let repeats = repeats.into_iter().map(difference).collect();
    (PhaseNoise::of(repeats, neighbours), moves_rad)
}

/// Visits of one point, each with the one before.
fn repeated_phases(
    scan: &ObservedScan,
    drive: &ObservedDrive,
    of_quadratures: impl Fn(usize) -> f64,
) -> Vec<RepeatedPhase> {
    /// Nanometres within which two visits are of one point.
    const SAME_NM: f64 = 1e4;
    let mut seen = HashMap::new();
    let mut pairs = Vec::new();
    for index in (0..drive.visits.len()).filter(|&index| tells_phase(scan, drive, index)) {
        let at_m = drive.visits[index].at_m;
        let cell: [i64; 3] = at_m.map(|m| (m * 1e9 / SAME_NM).round() as i64).into();
        if let Some(before) = seen.insert(cell, index) {
            pairs.push(RepeatedPhase {
                difference_rad: wrapped(drive.phases_rad[index] - drive.phases_rad[before]),
                from: drive.visits[before].progress,
                to: drive.visits[index].progress,
                quadratures: 0.5 * (of_quadratures(index) + of_quadratures(before)),
            });
        }
    }
    pairs
}

/// Third differences of what the believed field leaves along evenly spaced visits.
fn differences_of_neighbours(
    scan: &ObservedScan,
    drive: &ObservedDrive,
    of_quadratures: impl Fn(usize) -> f64,
) -> Vec<Difference> {
    /// Share of a step by which steps of a row may differ.
    const UNEVEN: f64 = 0.1;
    let step_m = |from: usize| drive.visits[from + 1].at_m - drive.visits[from].at_m;
    let mut differences = Vec::new();
    for first in 0..drive.visits.len().saturating_sub(3) {
        let even =
            |from: usize| (step_m(from) - step_m(first)).norm() <= UNEVEN * step_m(first).norm();
        let tell = (first..first + 4).all(|index| tells_phase(scan, drive, index));
        if tell && even(first + 1) && even(first + 2) {
            let left =
                [0, 1, 2, 3].map(|n| drive.phases_rad[first + n] - drive.believed_rad[first + n]);
            let difference = third_difference(left);
            let quadratures = [1.0, 9.0, 9.0, 1.0].iter().zip(first..);
            let quadratures: f64 = quadratures.map(|(w, index)| w * of_quadratures(index)).sum();
            differences.push((difference * difference / THIRD, quadratures / THIRD));
        }
    }
    differences
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Excitation, Vec3};

    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn half_a_turn_is_no_agreement_and_a_common_turn_is_none() {
        let bench = Bench::new();
        let places = (0..20).map(|n| Vec3::new(1e-3 * f64::from(n), 0.0, 0.1)).collect();
        let mut observations = bench.observations(&[(Excitation::Uniform, places)]);
        let scan = &mut observations.scans[0];
        let drive = &mut scan.drives[0];
        let field = bench.believed().clone();
        let uniform = fieldgap_acoustics::Simulation { excitation: Excitation::Uniform, ..field };
        let at: Vec<Vec3> = drive.visits.iter().map(|visit| visit.at_m).collect();
        let pressures: Vec<Pressure> =
            uniform.field(&at).into_iter().map(Pressure::steady).collect();
        let pressures: Vec<&Pressure> = pressures.iter().collect();
        drive.phases_rad = pressures.iter().map(|p| p.coherent.arg() + 2.5).collect();
        drive.phases_rad[7] += std::f64::consts::PI;
        drive.phases_rad[9] = f64::NAN;
        let noise = PhaseNoise { rad: 0.02, within: 1.0 };
        scan.phase =
            Some(PhaseMeaning { noise, drift_u_rad: 0.0, moves_rad: 0.0, each_drive: false });
        let scan = &observations.scans[0];
        let phases = PhaseResiduals::of(scan, &pressures, 1.0, false).expect("phases");
        let (half_turn, rest): (Vec<_>, Vec<_>) =
            phases.scaled.iter().enumerate().partition(|(n, _)| *n == 7);
        let reading = scan.drives[0].readings[7];
        let deviation = (0.01f64).hypot(0.02 * reading);
        assert!(
            (half_turn[0].1.abs() - 2.0 * reading / deviation).abs() < 1e-6 * reading / deviation
        );
        assert!(rest.iter().all(|(_, residual)| residual.abs() < 1e-6), "{rest:?}");
        assert_eq!(phases.scaled[9], 0.0);
    }
}
