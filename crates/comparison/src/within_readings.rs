//! Noise of the single magnitudes that a receiver averages into one reading, from their scatter within each reading.
//!
//! Far above the noise their variance is b² + a² r², with b that of a quadrature and a the noise in proportion. Hundreds of readings tell b to some
//! percent. The readings with the array silent tell the power of noise and floor together, and so what a floor adds to it.

use fieldgap_records::RecordedSample;

/// Single magnitudes of a reading below which its scatter is not used.
const FEWEST_SINGLE: u32 = 4;

/// Readings with scatter that determine b, at least; each of 16 magnitudes tells a variance to 37 %.
const FEWEST_DRIVEN: usize = 50;

/// Silent readings below which they say nothing.
const FEWEST_SILENT: usize = 8;

/// Readings above so many times the mean silent one are far above noise and floor: the scatter of a magnitude is that of a quadrature to a
/// hundredth.
const FAR_ABOVE: f64 = 4.0;

/// Ratio of the scatter between silent readings to that expected of the scatter within, up to which noise is taken to be independent from
/// one magnitude to the next. Twelve readings exceed it by chance once in a thousand scans (F distribution). Slow noise does not show within
/// a reading.
const INDEPENDENT: f64 = 3.0;

/// Rounds of weighing by the variances that were found.
const ROUNDS: usize = 6;

/// What the scatter within readings tells of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WithinReadings {
    /// Variance of each quadrature's noise in a single magnitude.
    pub variance: f64,
    /// Relative standard error of that.
    pub relative_error: f64,
    /// Variance of a single magnitude with the array silent.
    pub silent_variance: f64,
    /// Mean square of the single magnitudes with the array silent.
    pub silent_power: f64,
    /// How many magnitudes that is the mean of.
    pub silent_magnitudes: f64,
}

impl WithinReadings {
    /// Of the readings of a scan; `None` where they have no scatter, are too few, or show noise that is not independent from one magnitude to the
    /// next.
    pub fn of(samples: &[RecordedSample]) -> Option<Self> {
        let [silent, driven] = [true, false].map(|silent| {
            let of_kind = samples.iter().filter(|sample| sample.focus.is_none() == silent);
            of_kind.filter_map(Single::of).collect::<Vec<Single>>()
        });
        if silent.len() < FEWEST_SILENT {
            return None;
        }
        let mean = |value: &dyn Fn(&Single) -> f64| {
            silent.iter().map(value).sum::<f64>() / silent.len() as f64
        };
        let (reading, within) = (mean(&|one| one.reading), mean(&|one| one.variance));
        let between = silent.iter().map(|one| (one.reading - reading).powi(2)).sum::<f64>()
            / (silent.len() - 1) as f64;
        let expected = within * mean(&|one| 1.0 / one.count);
        let far = FAR_ABOVE * reading;
        let driven: Vec<Single> = driven.into_iter().filter(|one| one.reading > far).collect();
        if driven.len() < FEWEST_DRIVEN || between > INDEPENDENT * expected {
            return None;
        }
        let (variance, error) = quadrature(&driven)?;
        Some(Self {
            variance,
            relative_error: error / variance,
            silent_variance: within,
            // The mean square of a reading's magnitudes, its variance being stated with one degree of freedom less.
            silent_power: mean(&|one| {
                one.reading * one.reading + one.variance * (1.0 - 1.0 / one.count)
            }),
            silent_magnitudes: silent.iter().map(|one| one.count).sum(),
        })
    }

    /// The power that silence has beyond noise, and by how much the readings prefer it to none, in nats; zeros for none.
    ///
    /// The power of n magnitudes of noise alone is a mean of n exponential numbers: a ratio q to its expectation costs n (q - 1 - ln q). The
    /// error of the expectation makes n smaller.
    pub fn floor_power(&self) -> (f64, f64) {
        let ratio = self.silent_power / (2.0 * self.variance);
        if ratio <= 1.0 {
            return (0.0, 0.0);
        }
        let count = self.silent_magnitudes
            / (1.0 + self.silent_magnitudes * self.relative_error * self.relative_error);
        (self.silent_power - 2.0 * self.variance, count * (ratio - 1.0 - ratio.ln()))
    }
}

/// One reading of several magnitudes.
struct Single {
    reading: f64,
    variance: f64,
    count: f64,
}

impl Single {
    fn of(sample: &RecordedSample) -> Option<Self> {
        let spread = sample.spread.filter(|spread| spread.count >= FEWEST_SINGLE)?;
        let (reading, variance) = (sample.reading, spread.std * spread.std);
        Some(Self { reading, variance, count: f64::from(spread.count) })
    }
}

/// The variance at no level and its standard error, by a line through the variances over the squared readings, each weighed by its own
/// error. `None` if it is not above zero.
fn quadrature(readings: &[Single]) -> Option<(f64, f64)> {
    let mean = readings.iter().map(|one| one.variance).sum::<f64>() / readings.len() as f64;
    let (mut at_zero, mut slope, mut error) = (mean, 0.0, f64::INFINITY);
    for _ in 0..ROUNDS {
        let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
        for one in readings {
            let square = one.reading * one.reading;
            let expected = at_zero + slope * square;
            // A variance of c normal numbers has a relative variance of 2 / (c - 1).
            let weight = 0.5 * (one.count - 1.0) / (expected * expected);
            n += weight;
            x += weight * square;
            y += weight * one.variance;
            xx += weight * square * square;
            xy += weight * square * one.variance;
        }
        let determinant = n * xx - x * x;
        (at_zero, slope, error) = match (n * xy - x * y) / determinant {
            slope if slope > 0.0 => ((y - slope * x) / n, slope, (xx / determinant).sqrt()),
            _ => (y / n, 0.0, n.sqrt().recip()),
        };
        if !(at_zero > 0.0 && error.is_finite()) {
            return None;
        }
    }
    Some((at_zero, error))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::dark_readings::DarkReadings;
    use fieldgap_acoustics::Vec3;
    use fieldgap_records::Spread;

    const SINGLE: usize = 16;
    const NOISE: f64 = 0.01;

    /// A reading of magnitudes whose noise comes in after a floor, or before it; `slow` is a share of the noise that all of them have in common.
    fn sample(
        level: f64,
        (floor, before_noise): (f64, bool),
        slow: f64,
        draws: &mut ChaCha8Rng,
    ) -> RecordedSample {
        let mut normal = || -> f64 { StandardNormal.sample(draws) };
        let common = [normal(), normal()].map(|n| NOISE * slow * n);
        let fast = NOISE * (1.0 - slow * slow).sqrt();
        let (at, after) = if before_noise { (level.hypot(floor), 0.0) } else { (level, floor) };
        let magnitudes: Vec<f64> = (0..SINGLE)
            .map(|_| {
                let along = at * (1.0 + 0.05 * normal()) + common[0] + fast * normal();
                along.hypot(common[1] + fast * normal()).hypot(after)
            })
            .collect();
        let mean = magnitudes.iter().sum::<f64>() / SINGLE as f64;
        let squares = magnitudes.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
        let std = (squares / (SINGLE - 1) as f64).sqrt();
        let focus = (level > 0.0).then_some(0);
        let sample = RecordedSample::measured(0.0, focus, Vec3::zeros(), mean, None);
        RecordedSample { spread: Some(Spread { std, count: SINGLE as u32 }), ..sample }
    }

    fn samples(floor: (f64, bool), slow: f64, seed: u64) -> Vec<RecordedSample> {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let levels = (0..40).map(|_| 0.0).chain((1..500).map(|n| 0.002 * f64::from(n)));
        levels.map(|level| sample(level, floor, slow, &mut draws)).collect()
    }

    fn within(floor: f64, slow: f64, seed: u64) -> Option<WithinReadings> {
        WithinReadings::of(&samples((floor, true), slow, seed))
    }

    #[test]
    fn a_floor_as_large_as_the_noise_of_one_magnitude_is_seen_and_none_where_there_is_none() {
        for seed in 0..5 {
            let known = within(NOISE, 0.0, seed).expect("enough readings");
            assert!((known.variance / (NOISE * NOISE) - 1.0).abs() < 0.15, "{known:?}");
            let (power, evidence) = known.floor_power();
            assert!((power / (NOISE * NOISE) - 1.0).abs() < 0.4, "{power}");
            assert!(evidence > 12.0, "{evidence}");
            let none = within(0.0, 0.0, seed).expect("enough readings");
            assert!(none.floor_power().1 < 4.0, "{none:?}");
        }
    }

    #[test]
    fn whether_noise_comes_in_before_or_after_a_floor_is_seen_by_how_silence_scatters() {
        for (seed, before_noise) in (0..4).flat_map(|seed| [(seed, true), (seed, false)]) {
            let floor = 3.0 * NOISE;
            let samples = samples((floor, before_noise), 0.0, seed);
            let silent: Vec<f64> =
                samples.iter().filter(|s| s.focus.is_none()).map(|s| s.reading).collect();
            let dark = DarkReadings::of(&silent, SINGLE as f64).expect("enough");
            let noise = dark.with_scatter(WithinReadings::of(&samples)).noise(0.02);
            assert_eq!(noise.before_noise, before_noise, "{noise:?}");
            assert!((noise.floor / floor - 1.0).abs() < 0.05, "{noise:?}");
            assert!((noise.additive * 4.0 / NOISE - 1.0).abs() < 0.15, "{noise:?}");
        }
    }

    #[test]
    fn slow_noise_is_not_judged_by_the_scatter_within_readings() {
        for seed in 0..5 {
            assert_eq!(within(0.0, 0.9, seed), None);
        }
    }
}
