//! Measured less simulated phases, in a registration.
//!
//! Of a reading m whose phase differs from the simulated one by Δ, the residual is 2 m sin(Δ/2). Where the amplitudes agree, its square and that of the
//! amplitudes' residual add up to the squared distance of the two as complex numbers. Its variance is σ² + (s m)²: σ is that of the amplitudes' residual,
//! which the quadrature has too, and s is the noise of a phase itself with whatever else turns it. s is that of the residuals.
//!
//! The phase of the reference is not known. Its constant, one for the scan or one for each drive, is free. It drifts as a Brownian motion, whose standard
//! deviation at the end of the scan is that of the record: a linear drift and the first waves of a bridge (I. Karatzas and S. E. Shreve, *Brownian Motion
//! and Stochastic Calculus*, 1991, sections 2.3 and 5.6.B). Both are fitted at each pose and taken out of the derivatives (variable projection), so that a pose which a
//! drift would imitate is told by the amplitudes alone.

use std::f64::consts::{PI, SQRT_2};

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use num_complex::Complex64;

use super::readings::{Readings, Reference, Simulated};

/// Waves of the drift beside its linear part: what is left of a linear drift by u in so many is below u/100.
const WAVES: usize = 4;

/// Rounds by which constants and drift are found: from a drift by a radian on, one is not enough.
const ROUNDS: usize = 4;

/// Rounds in which noise of a phase, constants and drift follow one another.
const NOISE_ROUNDS: usize = 4;

/// Least and largest noise of a phase, radians: 3 µm of path at 40 kHz, which no robot repeats, and a phase that is anything.
const NOISE_RAD: [f64; 2] = [2e-3, 3.0];

/// The phases of readings at a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedPhases {
    /// Phases that are known.
    pub known: usize,
    /// Noise of a phase beside that of the quadratures, with what else the simulation leaves of it, radians.
    pub noise_rad: f64,
    /// Sum of the squared residuals over that of the readings.
    pub squared_ratio: f64,
    /// Largest departure of the reference from its mean, as fitted, radians.
    pub drift_rad: f64,
}

/// Residuals of the phases in standard deviations, the reference taken out.
#[derive(Debug, Clone)]
pub(super) struct PhaseResiduals {
    /// One for each reading, zero where the phase is not known, then one for each number of the drift beside its prior.
    pub scaled: Vec<f64>,
    /// Change of each by the simulated phase, the reference held.
    slopes: Vec<f64>,
    /// Ends of the stretches with a constant of their own.
    ends: Vec<usize>,
    /// How each changes with the numbers of the drift, the constants taken out.
    by_drift: Vec<Vec<f64>>,
    normal: Option<Cholesky<f64, Dyn>>,
    drift_u_rad: f64,
    drift_rad: f64,
}

impl FittedPhases {
    /// Beside a simulation whose amplitudes leave residuals of this standard deviation; `None` where phases are not used.
    pub fn of(readings: &Readings, simulated: &Simulated, sigma: f64) -> Option<Self> {
        readings.reference()?;
        let values = readings.values();
        /// Noise of a phase to begin with, radians.
        const START_RAD: f64 = 0.1;
        let (mut noise_rad, mut drift_rad, mut pairs) = (START_RAD, 0.0, Vec::new());
        for _ in 0..NOISE_ROUNDS {
            let scatter = Scatter { sigma, noise_rad, factor: 1.0 };
            let phases = PhaseResiduals::of(readings, simulated, scatter)?;
            drift_rad = phases.drift_rad;
            let scaled = phases.scaled.iter().zip(&values).zip(&phases.slopes);
            let known = scaled.filter(|(_, slope)| **slope != 0.0);
            pairs = known.map(|((r, value), _)| (r * scatter.of(*value), *value)).collect();
            noise_rad = noise_of(&pairs, sigma);
        }
        let sum =
            |of: fn(&(f64, f64)) -> f64| pairs.iter().map(|pair| of(pair).powi(2)).sum::<f64>();
        Some(Self {
            known: pairs.len(),
            noise_rad,
            squared_ratio: sum(|pair| pair.0) / sum(|pair| pair.1).max(f64::MIN_POSITIVE),
            drift_rad,
        })
    }
}

/// How phases scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    /// Standard deviation of the quadratures, in the reading's unit.
    pub sigma: f64,
    /// Noise of a phase beside them, radians.
    pub noise_rad: f64,
    /// All standard deviations, that of the reference's drift too, are larger by this factor.
    pub factor: f64,
}

impl Scatter {
    fn of(&self, reading: f64) -> f64 {
        self.factor * self.sigma.hypot(self.noise_rad * reading)
    }
}

/// The likeliest noise of a phase, given residuals with their readings, and the quadratures' noise.
fn noise_of(pairs: &[(f64, f64)], sigma: f64) -> f64 {
    // The derivative of the likelihood by the noise's square.
    let is_larger = |noise_rad: f64| {
        let of = |(residual, value): &(f64, f64)| {
            let variance = sigma * sigma + (noise_rad * value).powi(2);
            (residual * residual / variance - 1.0) * value * value / variance
        };
        pairs.iter().map(of).sum::<f64>() > 0.0
    };
    let [mut least, mut most] = NOISE_RAD;
    while most / least > 1.005 {
        let between = (least * most).sqrt();
        if is_larger(between) { least = between } else { most = between }
    }
    (least * most).sqrt()
}

/// The parts of a drift at a moment of the scan, each for a standard deviation of one.
fn parts(progress: f64) -> [f64; WAVES + 1] {
    std::array::from_fn(|n| match n {
        0 => progress,
        n => SQRT_2 * (n as f64 * PI * progress).sin() / (n as f64 * PI),
    })
}

impl PhaseResiduals {
    /// Beside a simulation; `None` where phases are not used.
    pub fn of(readings: &Readings, simulated: &Simulated, scatter: Scatter) -> Option<Self> {
        let Reference { each_drive, drift_u_rad } = readings.reference()?;
        let drift_u_rad = scatter.factor * drift_u_rad;
        let drives = readings.drives();
        let phases: Vec<_> = drives.iter().flat_map(|drive| &drive.phases).collect();
        let weights: Vec<f64> = phases
            .iter()
            .zip(readings.values())
            .map(|(phase, value)| phase.rad.map_or(0.0, |_| value / scatter.of(value)))
            .collect();
        let turns: Vec<Complex64> = phases
            .iter()
            .zip(&simulated.turns)
            .map(|(phase, turn)| Complex64::cis(phase.rad.unwrap_or(0.0)) * turn.conj())
            .collect();
        let parts: Vec<[f64; WAVES + 1]> = match drift_u_rad > 0.0 {
            true => phases.iter().map(|phase| parts(phase.progress)).collect(),
            false => Vec::new(),
        };
        let ends = match each_drive {
            true => drives
                .iter()
                .scan(0, |end, drive| {
                    *end += drive.readings.len();
                    Some(*end)
                })
                .collect(),
            false => vec![phases.len()],
        };
        Some(Self::beside(drift_u_rad, &weights, &turns, &parts, ends))
    }

    fn beside(
        u_rad: f64,
        weights: &[f64],
        turns: &[Complex64],
        parts: &[[f64; WAVES + 1]],
        ends: Vec<usize>,
    ) -> Self {
        let mut drift = DVector::zeros(if parts.is_empty() { 0 } else { WAVES + 1 });
        let mut all = Self {
            scaled: Vec::new(),
            slopes: Vec::new(),
            ends,
            by_drift: Vec::new(),
            normal: None,
            drift_u_rad: u_rad,
            drift_rad: 0.0,
        };
        for round in 0..=ROUNDS {
            let drifted = |n: usize| {
                let part = parts.get(n).into_iter().flatten();
                part.zip(&drift).map(|(part, size)| part * size).sum::<f64>()
            };
            let turned: Vec<Complex64> =
                (0..turns.len()).map(|n| turns[n] * Complex64::cis(-drifted(n))).collect();
            all.take(weights, &turned);
            if drift.is_empty() {
                break;
            }
            all.by_drift = (0..drift.len())
                .map(|k| {
                    let mut column: Vec<f64> =
                        all.slopes.iter().zip(parts).map(|(slope, part)| slope * part[k]).collect();
                    all.level(&mut column);
                    column
                })
                .collect();
            let by_drift = DMatrix::from_fn(turns.len(), drift.len(), |n, k| all.by_drift[k][n]);
            let mut normal = by_drift.transpose() * &by_drift;
            (0..drift.len()).for_each(|k| normal[(k, k)] += u_rad.powi(-2));
            all.normal = normal.cholesky();
            if round == ROUNDS {
                let mean = (0..turns.len()).map(drifted).sum::<f64>() / turns.len().max(1) as f64;
                let off = |n: usize| (drifted(n) - mean).abs();
                all.drift_rad = (0..turns.len()).map(off).fold(0.0, f64::max);
                break;
            }
            let Some(normal) = &all.normal else { break };
            let residuals = DVector::from_column_slice(&all.scaled);
            drift += normal.solve(&(by_drift.transpose() * residuals - &drift / u_rad.powi(2)));
        }
        all.scaled.extend(drift.iter().map(|size| size / u_rad));
        all
    }

    /// Residuals and slopes, the constants of the reference taken out.
    fn take(&mut self, weights: &[f64], turns: &[Complex64]) {
        self.scaled.clear();
        self.slopes.clear();
        let mut from = 0;
        for &end in &self.ends {
            let sum: Complex64 = (from..end).map(|n| weights[n] * weights[n] * turns[n]).sum();
            for n in from..end {
                let half_rad = 0.5 * (turns[n] * sum.conj()).arg();
                self.scaled.push(2.0 * weights[n] * half_rad.sin());
                self.slopes.push(weights[n] * half_rad.cos());
            }
            from = end;
        }
    }

    /// Takes the constants of the reference out of derivatives.
    fn level(&self, column: &mut [f64]) {
        let mut from = 0;
        for &end in &self.ends {
            let (slopes, column) = (&self.slopes[from..end], &mut column[from..end]);
            let power: f64 = slopes.iter().map(|slope| slope * slope).sum();
            let along: f64 = slopes.iter().zip(&*column).map(|(s, c)| s * c).sum();
            let by = along / power.max(f64::MIN_POSITIVE);
            column.iter_mut().zip(slopes).for_each(|(c, slope)| *c -= by * slope);
            from = end;
        }
    }

    /// Derivatives of the residuals, the reference following, from those of the simulated phases.
    pub fn derivatives(&self, of_phases: &[f64]) -> Vec<f64> {
        let mut column: Vec<f64> =
            of_phases.iter().zip(&self.slopes).map(|(of_phase, slope)| -of_phase * slope).collect();
        self.level(&mut column);
        if let Some(normal) = &self.normal {
            let along =
                self.by_drift.iter().map(|by| by.iter().zip(&column).map(|(b, c)| b * c).sum());
            let follows = normal.solve(&DVector::from_iterator(self.by_drift.len(), along));
            for (by, follows) in self.by_drift.iter().zip(&follows) {
                column.iter_mut().zip(by).for_each(|(c, b)| *c -= follows * b);
            }
            column.extend(follows.iter().map(|follows| follows / self.drift_u_rad));
        }
        column
    }
}
