//! How far noise alone makes the gap and the correlation scatter if the same scan is made again.
//!
//! Readings are r = m + e with independent noise e of variance σ², the simulation at the gain is s, the residual is d = r - s. The squared
//! gap is c = Σd²/Σr². Let Q = Σd² - cΣr² at this c. It is quadratic in the noise: its linear coefficients are 2(m - s - cm), its square ones
//! 1 - c. Its variance is therefore Σ[4σ²(m - s - cm)² + 2(1 - c)²σ⁴]. With the observed d - cr in place of m - s - cm, which has noise of its
//! own, the sum of squares is too large by 4(1 - c)²σ⁴ on average:
//!
//! var Q ≈ Σ[4σ²(d - cr)² - 2(1 - c)²σ⁴],  var gap ≈ var Q/(2 gap Σr²)².
//!
//! Without a gap beyond noise this is Σ2σ⁴, as for a χ² variable: the rule of small errors alone would give the double. That the gain (and
//! the pose) are fitted to the same readings changes nothing for all readings together, because the residual does not depend on them to first
//! order where its squares are least. At one height it does, and the change of the gain is counted. The correlation r satisfies
//! 1 - r² = Σd'²/Σ(r - mean)², where d' is the residual of the straight line of reading against simulation, and the same follows for it.
//!
//! The gap itself is not corrected for noise: its square is on average that without noise plus the square of the noise floor.

use std::ops::Range;

use fieldgap_comparison::{Comparison, simulated_readings};
use fieldgap_records::{RecordedScan, SAME_HEIGHT_MM, planes};

/// The readings of a scan with their simulation and the variance of their noise, plane by plane.
#[derive(Debug)]
pub(crate) struct NoisyReadings {
    readings: Vec<f64>,
    simulated: Vec<f64>,
    variances: Vec<f64>,
    planes: Vec<PlaneRange>,
    gain_fitted: bool,
}

/// Which readings are those of a plane.
#[derive(Debug)]
struct PlaneRange {
    focus: usize,
    z_mm: f64,
    range: Range<usize>,
}

impl NoisyReadings {
    /// Those of a scan and its comparison.
    pub(crate) fn of(scan: &RecordedScan, comparison: &Comparison) -> Self {
        let mut simulated = scan.samples.clone();
        for (sample, magnitude) in simulated.iter_mut().zip(simulated_readings(scan, comparison)) {
            sample.reading = magnitude;
        }
        let mut all = Self {
            readings: Vec::new(),
            simulated: Vec::new(),
            variances: Vec::new(),
            planes: Vec::new(),
            gain_fitted: comparison.registration.gain.estimated,
        };
        // Two scans with the same drives and places have the same planes.
        let pairs = scan.planes(SAME_HEIGHT_MM).into_iter().zip(planes(&simulated, SAME_HEIGHT_MM));
        for (measured, simulated) in pairs {
            let pairs = measured.samples.iter().zip(&simulated.samples);
            let pairs: Vec<(f64, f64)> = pairs
                .map(|(measured, simulated)| (measured.reading, simulated.reading))
                .filter(|(_, simulated)| simulated.is_finite())
                .collect();
            let from = all.readings.len();
            for (reading, magnitude) in pairs {
                all.readings.push(reading);
                all.simulated.push(magnitude);
                all.variances.push(comparison.noise.at(reading).powi(2));
            }
            let range = from..all.readings.len();
            all.planes.push(PlaneRange { focus: measured.focus, z_mm: measured.z_mm, range });
        }
        all
    }

    /// All readings.
    pub(crate) fn all(&self) -> Range<usize> {
        0..self.readings.len()
    }

    /// The readings of a drive at a height, mm; `None` where there is no such plane.
    pub(crate) fn plane(&self, focus: usize, z_mm: f64) -> Option<Range<usize>> {
        let same = |plane: &&PlaneRange| plane.focus == focus && (plane.z_mm - z_mm).abs() < 1e-6;
        self.planes.iter().find(same).map(|plane| plane.range.clone())
    }

    /// The gap that noise alone makes: root of Σσ²/Σr².
    pub(crate) fn noise_floor(&self) -> f64 {
        (self.variances.iter().sum::<f64>() / power(&self.readings)).sqrt()
    }

    /// Standard error of the gap over some readings, at the gain of all.
    pub(crate) fn gap_error(&self, of: Range<usize>) -> f64 {
        let (readings, simulated) = (&self.readings[of.clone()], &self.simulated[of.clone()]);
        let residual: Vec<f64> = readings.iter().zip(simulated).map(|(r, s)| r - s).collect();
        let total = power(readings);
        let squared_gap = power(&residual) / total;
        // How Σd² of these readings changes with the gain, over what fixes the gain.
        let across: f64 = residual.iter().zip(simulated).map(|(d, s)| d * s).sum();
        let pull = if self.gain_fitted { across / power(&self.simulated) } else { 0.0 };
        let coefficient = |(i, (s, variance)): (usize, (&f64, &f64))| {
            let own = match i.checked_sub(of.start).filter(|_| i < of.end) {
                Some(i) => residual[i] - squared_gap * readings[i],
                None => 0.0,
            };
            variance * (own - pull * s).powi(2)
        };
        let all = self.simulated.iter().zip(&self.variances).enumerate();
        let linear = all.map(coefficient).sum();
        let variance = self.quadratic_variance(linear, squared_gap, of);
        if variance == 0.0 { 0.0 } else { variance.sqrt() / (2.0 * squared_gap.sqrt() * total) }
    }

    /// Standard error of Pearson's correlation over some readings.
    pub(crate) fn correlation_error(&self, of: Range<usize>) -> f64 {
        let readings = centred(&self.readings[of.clone()]);
        let simulated = centred(&self.simulated[of.clone()]);
        let (total, of_simulated) = (power(&readings), power(&simulated));
        let slope = readings.iter().zip(&simulated).map(|(r, s)| r * s).sum::<f64>() / of_simulated;
        let unexplained: Vec<f64> =
            readings.iter().zip(&simulated).map(|(r, s)| r - slope * s).collect();
        let share = power(&unexplained) / total;
        let correlation = (1.0 - share).max(0.0).sqrt();
        let variances = &self.variances[of.clone()];
        let linear = unexplained.iter().zip(&readings).zip(variances);
        let linear = linear.map(|((d, r), variance)| variance * (d - share * r).powi(2)).sum();
        let variance = self.quadratic_variance(linear, share, of);
        if variance == 0.0 { 0.0 } else { variance.sqrt() / (2.0 * correlation * total) }
    }

    /// Variance of Q, given Σσ²(d - cr)².
    fn quadratic_variance(&self, linear: f64, share: f64, of: Range<usize>) -> f64 {
        let fourth: f64 = self.variances[of].iter().map(|variance| variance * variance).sum();
        let of_noise_alone = 2.0 * (1.0 - share).powi(2) * fourth;
        (4.0 * linear - of_noise_alone).max(of_noise_alone)
    }
}

fn power(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// The values less their mean.
fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}
