//! How the readings of a laboratory come out of the field: their noise, and what else befalls them between receiver and record.

use std::f64::consts::FRAC_PI_2;

use num_complex::Complex64;

use fieldgap_records::PhaseConvention;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// Periods of the slow noise, in readings: one octave each, with the same power, which is a spectrum of 1/f over three decades.
const PERIODS: [u32; 10] = [8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096];

/// The smallest outlier, in standard deviations of the noise.
const LEAST_OUTLIER: f64 = 3.0;

/// Full scale of the converter over the expected peak.
const HEADROOM: f64 = 1.6;

/// What befalls readings beside the noise of each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Reception {
    /// Relative standard deviation of a slow change of the level.
    pub slow: f64,
    /// Wrong readings, if any.
    pub outliers: Option<Outliers>,
    /// Bits of the converter; `None`: as fine as the record.
    pub bits: Option<u32>,
    /// Share of the stops without a reading.
    pub lost: f64,
    /// The phase of readings, where it is measured.
    pub phase: Option<PhaseReading>,
}

/// Wrong readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Outliers {
    /// Their share.
    pub share: f64,
    /// The largest, in standard deviations of the noise.
    pub most_sigma: f64,
}

/// How a receiver that has a reference measures phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PhaseReading {
    /// Standard deviation of a reading's phase, rad, beside the noise in quadrature.
    pub noise_rad: f64,
    /// Phase of the reference at the beginning, rad.
    pub offset_rad: f64,
    /// Its linear drift from the first driven reading to the last, rad.
    pub drift_rad: f64,
    /// How the record states phases.
    pub convention: PhaseConvention,
}

impl Reception {
    /// The factor of the slow change at the `n`th reading.
    pub fn slow_factor(self, n: usize, rng: CounterRng) -> f64 {
        1.0 + self.slow * pink(n, rng.stream("slow"))
    }

    /// What is added to the `n`th reading because it is wrong, in standard deviations of the noise; usually zero.
    pub fn outlier_sigma(self, n: usize, rng: CounterRng) -> f64 {
        let draws = rng.stream("outliers").substream(n as u64);
        match self.outliers {
            Some(Outliers { share, most_sigma }) if draws.uniform(0) < share => {
                let size = LEAST_OUTLIER + (most_sigma - LEAST_OUTLIER) * draws.uniform(1);
                if draws.uniform(2) < 0.5 { -size } else { size }
            }
            _ => 0.0,
        }
    }

    /// A reading or a part of it as the converter has it, V.
    pub fn converted_v(self, reading_v: f64, peak_v: f64) -> f64 {
        let Some(bits) = self.bits else { return reading_v };
        let full_scale_v = HEADROOM * peak_v;
        let step_v = full_scale_v / f64::from(1u32 << bits);
        (reading_v / step_v).round() * step_v
    }

    /// Whether the `n`th stop has no reading.
    pub fn is_lost(self, n: usize, rng: CounterRng) -> bool {
        rng.stream("lost").uniform(n as u64) < self.lost
    }
}

impl PhaseReading {
    /// The factor on the phasor of the `n`th reading, at a share of the scan's time, 0 to 1.
    pub fn turn(self, n: usize, share: f64, rng: CounterRng) -> Complex64 {
        let noise_rad = self.noise_rad * rng.stream("phase").normal(n as u64);
        Complex64::from_polar(1.0, self.offset_rad + self.drift_rad * share + noise_rad)
    }

    /// The phase as the record states it, from -π to π.
    pub fn stated_rad(self, phasor: Complex64) -> f64 {
        self.convention.turned(phasor.arg())
    }
}

/// A number of unit variance that changes slowly from one index to the next, with a spectrum of 1/f.
fn pink(n: usize, rng: CounterRng) -> f64 {
    let octave = |(number, &period): (usize, &u32)| {
        let rng = rng.substream(number as u64);
        // Each octave at a place of its own, so that their knots do not fall together.
        let at = n as f64 / (0.5 * f64::from(period)) + 1e3 * rng.uniform(u64::MAX);
        let (sin, cos) = (FRAC_PI_2 * at.fract()).sin_cos();
        // cos² + sin² = 1 keeps the variance the same everywhere.
        cos * rng.normal(at as u64) + sin * rng.normal(at as u64 + 1)
    };
    let sum: f64 = PERIODS.iter().enumerate().map(octave).sum();
    sum / (PERIODS.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RNG: fn(u64) -> CounterRng = CounterRng::new;

    #[test]
    fn the_slow_change_has_unit_variance_and_as_much_power_in_each_octave() {
        let runs = 400;
        let (length, mut power, mut steps) = (512, 0.0, Vec::new());
        for run in 0..runs {
            let series: Vec<f64> = (0..length).map(|n| pink(n, RNG(run))).collect();
            power += series.iter().map(|v| v * v).sum::<f64>() / (length * runs as usize) as f64;
            // The mean square of the difference of means over neighbouring blocks is the power near that period.
            steps.push([16, 64].map(|block| {
                let means: Vec<f64> = series
                    .chunks(block)
                    .map(|chunk| chunk.iter().sum::<f64>() / block as f64)
                    .collect();
                let pairs = means.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
                pairs.sum::<f64>() / (means.len() - 1) as f64
            }));
        }
        assert!((power - 1.0).abs() < 0.1, "{power}");
        let mean = |which: usize| steps.iter().map(|s| s[which]).sum::<f64>();
        // White noise would have a quarter at four times the length; a random walk would have four times as much.
        let ratio = mean(1) / mean(0);
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
    }

    #[test]
    fn outliers_have_their_share_and_their_size() {
        let outliers = Some(Outliers { share: 0.01, most_sigma: 20.0 });
        let reception = Reception { outliers, ..Reception::default() };
        let all: Vec<f64> = (0..50_000).map(|n| reception.outlier_sigma(n, RNG(3))).collect();
        let wrong: Vec<f64> = all.into_iter().filter(|&size| size != 0.0).collect();
        assert!((wrong.len() as f64 / 500.0 - 1.0).abs() < 0.15, "{}", wrong.len());
        assert!(wrong.iter().all(|size| (3.0..=20.0).contains(&size.abs())));
        assert!(wrong.iter().any(|&size| size < 0.0) && wrong.iter().any(|&size| size > 0.0));
    }

    #[test]
    fn a_converter_has_steps_of_its_bits() {
        let reception = Reception { bits: Some(8), ..Reception::default() };
        let step_v = 1.6 * 2.0 / 256.0;
        for n in 0..100 {
            let read_v = 0.0213 * f64::from(n);
            let converted_v = reception.converted_v(read_v, 2.0);
            assert!((converted_v - read_v).abs() <= 0.5 * step_v + 1e-12);
            assert!((converted_v / step_v - (converted_v / step_v).round()).abs() < 1e-9);
        }
        assert_eq!(Reception::default().converted_v(0.123_456, 2.0), 0.123_456);
    }
}
