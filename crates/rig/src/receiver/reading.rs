//! A receiver's identity, and the reading of a point.

use super::protocol::Sample;

/// Properties that a receiver states.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ReceiverIdentity {
    /// Samples a second, Hz.
    pub rate_hz: f64,
    /// The magnitude at which the converter clips, in `unit`.
    pub full_scale: f64,
    /// Unit of the readings, for instance `V`.
    pub unit: String,
    /// Whether times come from the receiver's own clock. Otherwise they come from this machine's, and do not give the receiver's rate.
    pub own_clock: bool,
    /// Whether readings have a phase.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub phase: bool,
}

/// How far beyond its full scale a converter may read, as a factor: full scales are rounded, and gains calibrated. Set by judgement.
const OVER_RANGE: f64 = 1.25;

/// Whether a converter with this full scale can give this value. Another value was damaged on its way.
pub(super) fn is_possible(value: f64, full_scale: f64) -> bool {
    value.abs() <= OVER_RANGE * full_scale
}

/// The same of both parts of a sample.
pub(super) fn is_possible_sample(sample: &Sample, full_scale: f64) -> bool {
    [Some(sample.value), sample.quadrature]
        .into_iter()
        .flatten()
        .all(|value| is_possible(value, full_scale))
}

/// The readings of one point.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Reading {
    /// Mean, in the receiver's unit; of samples with a phase, the amplitude of their complex mean.
    pub mean: f64,
    /// Phase of the complex mean in the convention exp(-iωt), rad, where the receiver gives both parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_rad: Option<f64>,
    /// Sample standard deviation (divided by count - 1), in the receiver's unit; zero for one reading. Of samples with a phase, that of
    /// their parts along the mean.
    pub std: f64,
    /// Readings averaged; fewer than asked for where some were lost.
    pub count: usize,
    /// Whether the converter clipped in any of them.
    pub clipped: bool,
    /// Samples lost on the way, those of the settling time included.
    pub gaps: u32,
    /// Instant of the first averaged reading, s, on the receiver's clock.
    pub first_t_s: f64,
    /// Instant of the last averaged reading, s, on the receiver's clock.
    pub last_t_s: f64,
}

/// Averages samples as they come, by Welford's recurrence (B. P. Welford, Technometrics 4, 1962), which
/// loses no digits where the deviation is small beside the mean.
#[derive(Debug, Default)]
pub struct ReadingBuilder {
    count: usize,
    /// In phase and in quadrature.
    mean: [f64; 2],
    /// Sums of squares about the mean, in phase and in quadrature, and of products.
    squares: [f64; 2],
    products: f64,
    has_phase: bool,
    clipped: bool,
    first_t_us: u64,
    last_t_us: u64,
}

impl ReadingBuilder {
    /// Adds a sample: its time on the receiver's clock, µs, its value, and whether the converter clipped.
    pub fn add(&mut self, t_us: u64, value: f64, clipped: bool) {
        self.add_parts(t_us, [value, 0.0], clipped);
    }

    /// Adds a sample with a phase: in phase with the reference, and in quadrature.
    pub fn add_with_phase(&mut self, t_us: u64, parts: [f64; 2], clipped: bool) {
        self.has_phase = true;
        self.add_parts(t_us, parts, clipped);
    }

    fn add_parts(&mut self, t_us: u64, parts: [f64; 2], clipped: bool) {
        if self.count == 0 {
            self.first_t_us = t_us;
        }
        self.last_t_us = t_us;
        self.count += 1;
        let before = [0, 1].map(|part| parts[part] - self.mean[part]);
        for part in [0, 1] {
            self.mean[part] += before[part] / self.count as f64;
            self.squares[part] += before[part] * (parts[part] - self.mean[part]);
        }
        self.products += before[0] * (parts[1] - self.mean[1]);
        self.clipped |= clipped;
    }

    /// Samples added so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The reading, or `None` where there was no sample; `gaps` samples were lost.
    pub fn finish(&self, gaps: u32) -> Option<Reading> {
        let [re, im] = self.mean;
        let (mean, phase_rad, squares) = if self.has_phase {
            let phase_rad = im.atan2(re);
            let (sin, cos) = phase_rad.sin_cos();
            let along = cos * cos * self.squares[0] + sin * sin * self.squares[1];
            let squares = (along + 2.0 * sin * cos * self.products).max(0.0);
            (re.hypot(im), Some(phase_rad), squares)
        } else {
            (re, None, self.squares[0])
        };
        (self.count > 0).then(|| Reading {
            mean,
            phase_rad,
            std: if self.count > 1 { (squares / (self.count - 1) as f64).sqrt() } else { 0.0 },
            count: self.count,
            clipped: self.clipped,
            gaps,
            first_t_s: self.first_t_us as f64 * 1e-6,
            last_t_s: self.last_t_us as f64 * 1e-6,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_statistics_are_those_of_the_textbook() {
        let mut tally = ReadingBuilder::default();
        assert_eq!(tally.finish(0), None);
        for (index, value) in [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0].into_iter().enumerate() {
            tally.add(1_000_000 + index as u64 * 1000, value, index == 3);
        }
        let reading = tally.finish(2).expect("samples");
        assert!((reading.mean - 5.0).abs() < 1e-12);
        assert!((reading.std - (32.0_f64 / 7.0).sqrt()).abs() < 1e-12);
        assert!(reading.clipped && reading.gaps == 2 && reading.count == 8);
        assert!(
            (reading.first_t_s - 1.0).abs() < 1e-12 && (reading.last_t_s - 1.007).abs() < 1e-12
        );
    }

    #[test]
    fn samples_with_a_phase_are_averaged_before_the_amplitude_is_taken() {
        let mut tally = ReadingBuilder::default();
        // 3 - 4i, each with one more or less along it and two more or less across it: (0.6, -0.8) and (0.8, 0.6).
        for (along, across) in [(1.0, 2.0), (1.0, -2.0), (-1.0, 2.0), (-1.0, -2.0)] {
            let parts = [3.0 + 0.6 * along + 0.8 * across, -4.0 - 0.8 * along + 0.6 * across];
            tally.add_with_phase(0, parts, false);
        }
        let reading = tally.finish(0).expect("samples");
        assert!((reading.mean - 5.0).abs() < 1e-12);
        assert!((reading.phase_rad.expect("a phase") + (0.8f64).asin()).abs() < 1e-12);
        assert!((reading.std - (4.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{reading:?}");
    }

    #[test]
    fn a_converter_gives_no_more_than_its_full_scale() {
        assert!([0.0, 5.0, -5.0, 5.01].into_iter().all(|value| is_possible(value, 5.0)));
        for value in [50.0, -6.3, 1e160, f64::NAN, f64::NEG_INFINITY] {
            assert!(!is_possible(value, 5.0), "{value}");
        }
    }

    #[test]
    fn a_small_deviation_beside_a_large_mean_keeps_its_digits() {
        let mut tally = ReadingBuilder::default();
        for value in [1e9 + 1.0, 1e9 + 2.0, 1e9 + 3.0] {
            tally.add(0, value, false);
        }
        assert!((tally.finish(0).expect("samples").std - 1.0).abs() < 1e-9);
    }
}
