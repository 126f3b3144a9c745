//! Measured minus expected phases, in standard deviations.
//!
//! Of a reading m with the phase φ, expected at the phase θ, the residual is 2 m sin((φ - θ)/2) over its standard deviation. Near zero it is
//! the quadrature m sin(φ - θ). Its square is 2 m² (1 - cos(φ - θ)), which is the likelihood of a phase beside a known amplitude (von Mises's
//! distribution; K. V. Mardia and P. E. Jupp, *Directional Statistics*, 2000, section 3.5), so that half a turn is no agreement. The variance
//! is b² + (s m)²: b is the quadratures' noise, s the noise of the phase itself. It is that of the measured level, so that no set of effects
//! changes the weights, unless its field fluctuates.
//!
//! The phase of the reference is not known. Its constant is that which fits best, in closed form; its drift over the scan is linear, with a prior.
//! Both are taken out of the residuals and of their derivatives (variable projection; L. Kaufman, BIT 15, 49, 1975), so that no fit has them
//! among its numbers.

use std::collections::HashMap;

use num_complex::Complex64;

use super::observations::{ObservedDrive, ObservedScan};
use super::pressure::Pressure;
use crate::statistics::phase_noise::{Difference, PhaseNoise, THIRD, third_difference, wrapped};

/// Level, in quadratures' standard deviations, below which a phase says nothing: there its distribution is far from normal.
const LEAST_LEVEL: f64 = 3.0;

/// What is known of the phases of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PhaseMeaning {
    /// Standard deviation of the phases' own noise, rad.
    pub noise: PhaseNoise,
    /// Standard uncertainty of the reference's drift over the scan, rad.
    pub drift_u_rad: f64,
    /// Whether the reference starts anew with each drive.
    pub each_drive: bool,
}

/// The phases of one scan beside expected pressures.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PhaseResiduals {
    /// The residuals, in the order of the readings; zero where a phase says nothing.
    pub scaled: Vec<f64>,
    /// Slope of each by its phase difference.
    by_phase: Vec<f64>,
    /// How each changes with the drift of the reference, beside its constant.
    by_drift: Vec<f64>,
    /// Ends of the stretches with a constant of their own.
    ends: Vec<usize>,
    drift_u_rad: f64,
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
        let mut all = Self { drift_u_rad: meaning.drift_u_rad, ..Self::default() };
        let (mut turns, mut weights, mut moments) = (Vec::new(), Vec::new(), Vec::new());
        for drive in &scan.drives {
            for (index, visit) in drive.visits.iter().enumerate() {
                let pressure = pressures[turns.len()];
                let mut weight = weight(scan, drive, index);
                if fluctuates {
                    let across = gain * gain * pressure.speckle_along_and_across()[1];
                    let ratio = 1.0 + across / variance(scan, drive, index);
                    all.log_variances.push(if weight > 0.0 { ratio.ln() } else { 0.0 });
                    weight /= ratio.sqrt();
                }
                let against = |phase_rad: f64| {
                    let size = pressure.coherent.norm().max(f64::MIN_POSITIVE);
                    Complex64::cis(phase_rad) * pressure.coherent.conj() / size
                };
                turns.push(match weight > 0.0 {
                    true => against(drive.phases_rad[index]),
                    false => Complex64::ONE,
                });
                weights.push(weight);
                moments.push(visit.progress);
            }
            if meaning.each_drive {
                all.ends.push(turns.len());
            }
        }
        if !meaning.each_drive {
            all.ends.push(turns.len());
        }
        let mut from = 0;
        for &end in &all.ends {
            let of = from..end;
            let sum: Complex64 = of.clone().map(|n| weights[n] * weights[n] * turns[n]).sum();
            let back = sum.conj() / sum.norm().max(f64::MIN_POSITIVE);
            for n in of.clone() {
                let turn = turns[n] * back;
                let half_cosine = (0.5 * (1.0 + turn.re)).max(0.0).sqrt();
                // The root loses digits where the difference is small.
                let half_sine = match turn.re > 0.0 {
                    true => 0.5 * turn.im / half_cosine,
                    false => (0.5 * (1.0 - turn.re)).sqrt().copysign(turn.im),
                };
                all.scaled.push(2.0 * weights[n] * half_sine);
                all.by_phase.push(weights[n] * half_cosine);
            }
            let (mut power, mut first) = (0.0, 0.0);
            for n in of.clone() {
                let square = all.by_phase[n] * all.by_phase[n];
                power += square;
                first += square * moments[n];
            }
            let mean = first / power.max(f64::MIN_POSITIVE);
            all.by_drift.extend(of.map(|n| all.by_phase[n] * (moments[n] - mean)));
            from = end;
        }
        let mut scaled = std::mem::take(&mut all.scaled);
        all.shrink_along_drift(&mut scaled);
        Some(Self { scaled, ..all })
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

    /// Takes the constants and the drift of the reference out of derivatives of the residuals.
    pub fn project(&self, derivatives: &mut [f64]) {
        let mut from = 0;
        for &end in &self.ends {
            let (slopes, derivatives) = (&self.by_phase[from..end], &mut derivatives[from..end]);
            let power: f64 = slopes.iter().map(|slope| slope * slope).sum();
            let along: f64 = slopes.iter().zip(&*derivatives).map(|(s, d)| s * d).sum();
            let by = along / power.max(f64::MIN_POSITIVE);
            derivatives.iter_mut().zip(slopes).for_each(|(d, slope)| *d -= by * slope);
            from = end;
        }
        self.shrink_along_drift(derivatives);
    }

    /// With u the standard uncertainty of the drift and d how the residuals r change with it, the least of |r - a d|² + (a/u)² over the drift a
    /// is the squared length of r with its part along d shortened by √(1 + u² |d|²).
    fn shrink_along_drift(&self, residuals: &mut [f64]) {
        let power: f64 = self.by_drift.iter().map(|d| d * d).sum();
        let along: f64 = self.by_drift.iter().zip(&*residuals).map(|(d, r)| d * r).sum();
        let kept = (1.0 + self.drift_u_rad * self.drift_u_rad * power).sqrt().recip();
        let by = (1.0 - kept) * along / power.max(f64::MIN_POSITIVE);
        residuals.iter_mut().zip(&self.by_drift).for_each(|(r, d)| *r -= by * d);
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

/// The noise of a scan's phases beyond that of the quadratures.
pub(crate) fn phase_noise(scan: &ObservedScan) -> PhaseNoise {
    let (mut repeats, mut neighbours) = (Vec::new(), Vec::new());
    for drive in &scan.drives {
        let of_quadratures = |index: usize| {
            let relative = scan.scatter.additive / drive.readings[index];
            drive.visits[index].variance * relative * relative
        };
        repeats.extend(differences_of_repeats(scan, drive, of_quadratures));
        neighbours.extend(differences_of_neighbours(scan, drive, of_quadratures));
    }
    PhaseNoise::of(repeats, neighbours)
}

/// Differences between visits of one point, without the linear drift of the reference that they show.
fn differences_of_repeats(
    scan: &ObservedScan,
    drive: &ObservedDrive,
    of_quadratures: impl Fn(usize) -> f64,
) -> Vec<Difference> {
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
                apart: drive.visits[index].progress - drive.visits[before].progress,
                quadratures: 0.5 * (of_quadratures(index) + of_quadratures(before)),
            });
        }
    }
    let drift_rad = drift_of_repeats(&pairs, scan.phase.map_or(0.0, |phase| phase.drift_u_rad));
    let difference = |pair: &RepeatedPhase| {
        let left_rad = pair.difference_rad - drift_rad * pair.apart;
        (0.5 * left_rad * left_rad, pair.quadratures)
    };
    pairs.iter().map(difference).collect()
}

/// The phases of two visits of one point.
struct RepeatedPhase {
    difference_rad: f64,
    /// Share of the scan that lies between them.
    apart: f64,
    /// Variance by the quadratures' noise.
    quadratures: f64,
}

/// The drift of the reference over the scan, rad, that repeats show beside what is known of it: its mean is zero, with this standard deviation.
fn drift_of_repeats(pairs: &[RepeatedPhase], u_rad: f64) -> f64 {
    /// Variance of a phase's own noise that weighs repeats of high level alike, rad². Set by judgement.
    const OWN: f64 = 4e-4;
    let (mut along, mut power) = (0.0, u_rad.max(f64::MIN_POSITIVE).powi(-2));
    for RepeatedPhase { difference_rad, apart, quadratures } in pairs {
        let weight = 0.5 / (quadratures + OWN);
        along += weight * apart * difference_rad;
        power += weight * apart * apart;
    }
    along / power
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

    /// The least of the residuals and the prior over the drift, tried value by value.
    #[test]
    fn a_drift_costs_what_its_best_value_costs() {
        let phases = PhaseResiduals {
            by_drift: vec![-3.0, -1.0, 0.5, 3.5],
            drift_u_rad: 0.4,
            ..PhaseResiduals::default()
        };
        let mut residuals = [1.0, -2.0, 0.3, 2.0];
        let cost = |drift: f64| -> f64 {
            let pairs = residuals.iter().zip(&phases.by_drift);
            pairs.map(|(r, d)| (r - drift * d).powi(2)).sum::<f64>() + (drift / 0.4).powi(2)
        };
        let least = (-4000..4000).map(|n| cost(f64::from(n) * 1e-3)).fold(f64::INFINITY, f64::min);
        phases.shrink_along_drift(&mut residuals);
        let after = residuals.iter().map(|r| r * r).sum::<f64>();
        assert!((after - least).abs() < 1e-4, "{after} {least}");
    }

    /// A drift of three times the noise is no noise; one that the record excludes is none either.
    #[test]
    fn a_drift_between_repeats_is_found_as_far_as_it_may_be() {
        let pair = |n: i32| RepeatedPhase {
            difference_rad: 0.06 * (0.3 + 0.01 * f64::from(n)) + 0.02 * f64::from(n % 5 - 2),
            apart: 0.3 + 0.01 * f64::from(n),
            quadratures: 1e-4,
        };
        let pairs: Vec<RepeatedPhase> = (0..50).map(pair).collect();
        assert!((drift_of_repeats(&pairs, 0.1) - 0.06).abs() < 0.01);
        assert!(drift_of_repeats(&pairs, 1e-4).abs() < 1e-3);
        assert_eq!(drift_of_repeats(&pairs, 0.0), 0.0);
    }

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
        scan.phase = Some(PhaseMeaning { noise, drift_u_rad: 0.0, each_drive: false });
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
