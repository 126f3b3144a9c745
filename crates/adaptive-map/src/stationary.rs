//! The usual process without a simulation, to compare with: the amplitude itself is a stationary normal process about a constant.
//!
//! Matérn's covariance of order 5/2 (C. E. Rasmussen and C. K. I. Williams, *Gaussian Processes for Machine Learning*, eq. 4.17), with one
//! length across the axis and one along it; size, lengths and noise by the evidence. Each drive is a process of its own, with the same sizes.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use fieldgap_acoustics::Vec3;
use fieldgap_acoustics::least_squares::Factor;
use fieldgap_comparison::{DarkReadings, USUAL_PROPORTIONAL_NOISE, averaged_magnitudes};
use fieldgap_diagnosis::PossibleReading;
use fieldgap_records::RecordedScan;

use crate::estimate::{Estimate, FieldEstimate, Foretold};
use crate::sizes::climb;

/// Readings on which sizes are sought at most: the first of them. (Every second of a grid would hide the length that the grid shows.)
const MOST_READINGS: usize = 280;

/// Lengths that searches begin with, m, across the axis and along it; the better of both ends counts, because the evidence may have two maxima.
const FIRST_LENGTHS_M: [[f64; 2]; 2] = [[6e-3, 3e-2], [15e-3, 6e-2]];

/// Steps of the search, in logarithms.
const STEPS: [f64; 4] = [0.5, 0.4, 0.6, 0.4];

/// Standard deviation of the logarithm of the proportional noise about its usual size: with more, structure that a coarse grid does not resolve
/// is taken for noise.
const NOISE_WITHIN: f64 = 0.2;

/// Additive noise where no dark readings tell it, as a share of the largest reading.
const USUAL_ADDITIVE_NOISE: f64 = 5e-3;

/// A process conditioned on readings.
pub(crate) struct Stationary {
    at_m: Vec<Vec3>,
    foci: Vec<usize>,
    mean: f64,
    sizes: ProcessSizes,
    factor: Factor,
    weights: DVector<f64>,
    noise: ReadingNoise,
}

#[derive(Debug, Clone, Copy)]
struct ProcessSizes {
    size: f64,
    lengths_m: [f64; 2],
    share: f64,
}

/// The noise of a reading: of each of the magnitudes that it is the mean of, and of the mean.
#[derive(Debug, Clone, Copy)]
struct ReadingNoise {
    single: f64,
    additive: f64,
}

impl ReadingNoise {
    /// The level whose mean reading this is: noise adds to the mean of a magnitude (Rice). The mean of a level m is about
    /// √(m² + q²(1 + 0.57 / (1 + 0.43 m²/q²))).
    fn level(self, reading: f64) -> f64 {
        let q2 = (self.single * self.single).max(f64::MIN_POSITIVE);
        let mut power = reading * reading;
        for _ in 0..20 {
            let lost = 0.5708 / (1.0 + 0.434 * power / q2);
            power = (reading * reading - q2 * (1.0 + lost)).max(0.0);
        }
        power.sqrt()
    }

    /// The mean reading of a level.
    fn reading(self, level: f64) -> f64 {
        let q2 = (self.single * self.single).max(f64::MIN_POSITIVE);
        (level * level + q2 * (1.0 + 0.5708 / (1.0 + 0.434 * level * level / q2))).sqrt()
    }
}

impl ProcessSizes {
    fn covariance(&self, one_m: &Vec3, other_m: &Vec3) -> f64 {
        let by = one_m - other_m;
        let [across, along] = self.lengths_m;
        let distance =
            ((by.x.powi(2) + by.y.powi(2)) / (across * across) + (by.z / along).powi(2)).sqrt();
        let r = 5f64.sqrt() * distance;
        self.size * self.size * (1.0 + r + r * r / 3.0) * (-r).exp()
    }
}

impl Stationary {
    /// Of the driven readings of a record; `None` without any.
    pub fn of(record: &RecordedScan) -> Option<Self> {
        let driven: Vec<_> =
            record.samples.iter().filter_map(|sample| Some((sample, sample.focus?))).collect();
        let largest = driven.iter().map(|(sample, _)| sample.reading).fold(0.0, f64::max);
        let count = averaged_magnitudes(record);
        let additive = DarkReadings::of_scan(record)
            .map_or(USUAL_ADDITIVE_NOISE * largest, |dark| {
                dark.noise(USUAL_PROPORTIONAL_NOISE).additive
            });
        let noise = ReadingNoise { single: additive * count.sqrt(), additive };
        let at_m: Vec<Vec3> = driven.iter().map(|(sample, _)| sample.position_m()).collect();
        let foci: Vec<usize> = driven.iter().map(|(_, focus)| *focus).collect();
        let levels: Vec<f64> =
            driven.iter().map(|(sample, _)| noise.level(sample.reading)).collect();
        Self::conditioned(at_m, foci, &levels, noise)
    }

    fn conditioned(
        at_m: Vec<Vec3>,
        foci: Vec<usize>,
        levels: &[f64],
        noise: ReadingNoise,
    ) -> Option<Self> {
        let count = levels.len();
        let mean = levels.iter().sum::<f64>() / count.max(1) as f64;
        let spread = (levels.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        let size = spread.max(f64::MIN_POSITIVE);
        let covariance = |sizes: &ProcessSizes, kept: &[usize]| {
            let n = kept.len();
            let mut matrix = DMatrix::from_fn(n, n, |i, j| {
                let (i, j) = (kept[i], kept[j]);
                if foci[i] == foci[j] { sizes.covariance(&at_m[i], &at_m[j]) } else { 0.0 }
            });
            for (n, &index) in kept.iter().enumerate() {
                matrix[(n, n)] += (sizes.share * levels[index]).powi(2) + noise.additive.powi(2);
            }
            matrix
        };
        let of = |kept: &[usize]| {
            DVector::from_iterator(kept.len(), kept.iter().map(|&index| levels[index] - mean))
        };
        let some: Vec<usize> = (0..count.min(MOST_READINGS)).collect();
        let departures = of(&some);
        let at = |[size, across, along, share]: [f64; 4]| ProcessSizes {
            size: size.exp(),
            lengths_m: [across.exp(), along.exp()],
            share: share.exp(),
        };
        let evidence = |logs: [f64; 4]| -> f64 {
            let unusual = (logs[3] - USUAL_PROPORTIONAL_NOISE.ln()) / NOISE_WITHIN;
            let Some(factor) = Factor::of(covariance(&at(logs), &some)) else {
                return f64::NEG_INFINITY;
            };
            let misfit = departures.dot(&factor.solve(&departures));
            -0.5 * (misfit + factor.log_determinant() + unusual * unusual)
        };
        let ends = FIRST_LENGTHS_M.map(|[across, along]| {
            let start = [size, across, along, USUAL_PROPORTIONAL_NOISE].map(f64::ln);
            let end = climb(start, STEPS, evidence);
            (evidence(end), end)
        });
        let best = ends.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let sizes = at(best.1);
        let all: Vec<usize> = (0..count).collect();
        let factor = Factor::of(covariance(&sizes, &all))?;
        let weights = factor.solve(&of(&all));
        Some(Self { at_m, foci, mean, sizes, factor, weights, noise })
    }

    fn with_readings(&self, places: &[PossibleReading]) -> DMatrix<f64> {
        let column = |place: &PossibleReading| -> Vec<f64> {
            let readings = self.at_m.iter().zip(&self.foci);
            readings
                .map(|(at_m, focus)| match *focus == place.focus {
                    true => self.sizes.covariance(at_m, &place.at_m),
                    false => 0.0,
                })
                .collect()
        };
        let values: Vec<f64> = places.par_iter().flat_map_iter(column).collect();
        DMatrix::from_vec(self.at_m.len(), places.len(), values)
    }
}

impl FieldEstimate for Stationary {
    fn map(&self, places: &[PossibleReading]) -> Vec<Estimate> {
        let with = self.with_readings(places);
        let whitened = self.factor.whitened(&with);
        let means = with.tr_mul(&self.weights);
        (0..places.len())
            .map(|n| {
                let variance = self.sizes.size.powi(2) - whitened.column(n).norm_squared();
                Estimate {
                    amplitude: (self.mean + means[n]).max(0.0),
                    standard_error: variance.max(0.0).sqrt(),
                }
            })
            .collect()
    }

    fn foretold(&self, places: &[PossibleReading], _moment: f64) -> Vec<Foretold> {
        let estimates = self.map(places);
        estimates
            .iter()
            .map(|estimate| Foretold {
                reading: self.noise.reading(estimate.amplitude),
                standard_error: estimate.standard_error,
                noise: (self.sizes.share * estimate.amplitude).hypot(self.noise.additive),
            })
            .collect()
    }

    fn covariance(
        &self,
        targets: &[PossibleReading],
        possible: &[PossibleReading],
    ) -> DMatrix<f64> {
        let [a, b] =
            [targets, possible].map(|places| self.factor.whitened(&self.with_readings(places)));
        let mut between = DMatrix::from_fn(targets.len(), possible.len(), |i, j| {
            let (one, other) = (&targets[i], &possible[j]);
            if one.focus == other.focus {
                self.sizes.covariance(&one.at_m, &other.at_m)
            } else {
                0.0
            }
        });
        between -= a.tr_mul(&b);
        between
    }
}
