//! A receiver's identity, and the reading of a point.

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
}

/// How far beyond its full scale a converter may read, as a factor: full scales are rounded, and gains calibrated. Set by judgement.
const OVER_RANGE: f64 = 1.25;

/// Whether a converter with this full scale can give this value. Another value was damaged on its way.
pub(super) fn is_possible(value: f64, full_scale: f64) -> bool {
    value.abs() <= OVER_RANGE * full_scale
}

/// The readings of one point.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Reading {
    /// Mean, in the receiver's unit.
    pub mean: f64,
    /// Sample standard deviation (divided by count - 1), in the receiver's unit; zero for one reading.
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
    mean: f64,
    squares: f64,
    clipped: bool,
    first_t_us: u64,
    last_t_us: u64,
}

impl ReadingBuilder {
    /// Adds a sample: its time on the receiver's clock, µs, its value, and whether the converter clipped.
    pub fn add(&mut self, t_us: u64, value: f64, clipped: bool) {
        if self.count == 0 {
            self.first_t_us = t_us;
        }
        self.last_t_us = t_us;
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
        self.clipped |= clipped;
    }

    /// Samples added so far.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The reading, or `None` where there was no sample; `gaps` samples were lost.
    pub fn finish(&self, gaps: u32) -> Option<Reading> {
        (self.count > 0).then(|| Reading {
            mean: self.mean,
            std: if self.count > 1 { (self.squares / (self.count - 1) as f64).sqrt() } else { 0.0 },
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
