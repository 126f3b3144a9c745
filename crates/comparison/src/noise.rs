//! The noise of one reading: from repeats, else from silent readings, else from the roughness of the residual.

use super::comparison::{Noise, NoiseSource};
use super::dark_readings::{DarkReadings, USUAL_PROPORTIONAL_NOISE};
use fieldgap_records::{RecordedScan, Repeat, SAME_POINT_MM};

/// Fewest repeated visits from which noise is estimated.
const ENOUGH_REPEATS: usize = 5;

impl Noise {
    /// Standard deviation of a reading at a level, both in the reading's unit.
    pub fn at(&self, level: f64) -> f64 {
        self.additive.hypot(self.multiplicative * level)
    }

    /// Estimates the noise of a scan; `of_residual` is used if it has neither repeats nor silent readings.
    pub fn of(scan: &RecordedScan, of_residual: Self) -> Self {
        let dark = DarkReadings::of_scan(scan);
        let floor = dark.map(|dark| dark.noise(USUAL_PROPORTIONAL_NOISE).additive);
        let repeats: Vec<Repeat<'_>> = scan
            .repeats(SAME_POINT_MM)
            .into_iter()
            .filter(|repeat| repeat.focus.is_some())
            .collect();
        if let Some(noise) = from_repeats(&repeats, floor) {
            return noise;
        }
        match floor {
            Some(additive) => {
                Self { additive, multiplicative: 0.0, source: NoiseSource::SilentReadings }
            }
            None => of_residual,
        }
    }
}

/// The constant part is that of the silent readings; scatter of the repeats beyond it is taken as proportional to their level. Without a floor,
/// all scatter is taken as independent of the level.
fn from_repeats(repeats: &[Repeat<'_>], floor: Option<f64>) -> Option<Noise> {
    let freedom: usize = repeats.iter().map(|repeat| repeat.samples.len() - 1).sum();
    if freedom < ENOUGH_REPEATS {
        return None;
    }
    let (mut squares, mut power) = (0.0, 0.0);
    for repeat in repeats {
        let mean = repeat.mean();
        squares += repeat.samples.iter().map(|s| (s.reading - mean).powi(2)).sum::<f64>();
        power += (repeat.samples.len() - 1) as f64 * mean * mean;
    }
    let variance = squares / freedom as f64;
    let level_squared = power / freedom as f64;
    Some(match floor {
        Some(floor) if level_squared > 0.0 => {
            let beyond = (variance - floor * floor).max(0.0);
            let multiplicative = (beyond / level_squared).sqrt();
            Noise { additive: floor, multiplicative, source: NoiseSource::Repeats }
        }
        _ => Noise { additive: variance.sqrt(), multiplicative: 0.0, source: NoiseSource::Repeats },
    })
}

/// Points above this share of the largest level determine the part of the noise that is proportional to the level, the others the
/// constant part.
const HIGH_LEVEL: f64 = 0.5;

/// The noise of a map's points from the roughness of the residual: its third differences along the rows, whose mean square is 20 times
/// the variance of white noise.
///
/// On a fine grid a pattern as wide as half a wavelength has nearly no third differences. What remains of it makes this an upper bound.
#[derive(Debug, Clone, Default)]
pub struct Roughness {
    /// Level squared, and variance from one third difference.
    estimates: Vec<(f64, f64)>,
}

impl Roughness {
    /// Adds a map: scan and simulation, in one unit, row by row with a number of columns.
    pub fn add(&mut self, scan: &[f64], simulation: &[f64], columns: usize) {
        for (scan, simulation) in scan.chunks(columns).zip(simulation.chunks(columns)) {
            for (scan, simulation) in scan.windows(4).zip(simulation.windows(4)) {
                let residual = |i: usize| scan[i] - simulation[i];
                let third = residual(3) - 3.0 * residual(2) + 3.0 * residual(1) - residual(0);
                if !third.is_nan() {
                    let level = 0.5 * (scan[1] + scan[2]);
                    self.estimates.push((level * level, third * third / 20.0));
                }
            }
        }
    }

    /// The noise; `None` where no four neighbours were measured.
    pub fn noise(&self) -> Option<Noise> {
        let largest =
            self.estimates.iter().map(|(level_squared, _)| *level_squared).fold(0.0, f64::max);
        let limit = HIGH_LEVEL * HIGH_LEVEL * largest;
        let mean = |high: bool| {
            let (mut levels, mut variances, mut count) = (0.0, 0.0, 0.0);
            for (level, variance) in
                self.estimates.iter().filter(|(level, _)| (*level > limit) == high)
            {
                levels += level;
                variances += variance;
                count += 1.0;
            }
            (count > 0.0).then(|| (levels / count, variances / count))
        };
        let (high, low) = (mean(true), mean(false));
        let (additive_squared, multiplicative_squared) = match (high, low) {
            (Some((high_level, high)), Some((low_level, low))) if high_level > low_level => {
                let multiplicative = ((high - low) / (high_level - low_level)).max(0.0);
                ((low - multiplicative * low_level).max(0.0), multiplicative)
            }
            (Some((_, variance)), _) | (None, Some((_, variance))) => (variance, 0.0),
            (None, None) => return None,
        };
        Some(Noise {
            additive: additive_squared.sqrt(),
            multiplicative: multiplicative_squared.sqrt(),
            source: NoiseSource::Residual,
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_records::RecordedSample;

    fn sample(reading: f64) -> RecordedSample {
        RecordedSample::measured(0.0, Some(0), Vec3::zeros(), reading, None)
    }

    fn repeat<'s>(samples: &'s [RecordedSample]) -> Repeat<'s> {
        Repeat { focus: Some(0), position_mm: Vec3::zeros(), samples: samples.iter().collect() }
    }

    #[test]
    fn scatter_of_repeats_beyond_the_floor_is_proportional_to_the_level() {
        // Two levels, each ±2 % about its mean: as variance about the mean 1.2 times (2 % of level)².
        let low: Vec<RecordedSample> =
            (0..6).map(|i| sample(10.0 + 0.2 * f64::from(1 - 2 * (i % 2)))).collect();
        let high: Vec<RecordedSample> =
            (0..6).map(|i| sample(100.0 + 2.0 * f64::from(1 - 2 * (i % 2)))).collect();
        let repeats = [repeat(&low), repeat(&high)];
        let noise = from_repeats(&repeats, Some(1e-6)).expect("ten degrees of freedom");
        assert!((noise.multiplicative - 0.02 * 1.2f64.sqrt()).abs() < 1e-9, "{noise:?}");
        let without_floor = from_repeats(&repeats, None).expect("ten degrees of freedom");
        assert_eq!(without_floor.multiplicative, 0.0);
        assert!(from_repeats(&repeats[..0], None).is_none());
    }

    #[test]
    fn roughness_sees_white_noise_and_its_two_parts_and_not_a_slow_pattern() {
        let n = 200;
        let mut draws = ChaCha8Rng::seed_from_u64(2);
        let level = |i: usize| 10.0 * (1.0 + (i % n) as f64 / n as f64 * 4.0);
        let simulation: Vec<f64> = (0..n * n).map(level).collect();
        let scan: Vec<f64> = (0..n * n)
            .map(|i| {
                let slow = 5.0 * ((i % n) as f64 / 20.0).sin();
                let (floor, share): (f64, f64) =
                    (StandardNormal.sample(&mut draws), StandardNormal.sample(&mut draws));
                level(i) * (1.0 + 0.02 * share) + slow + 0.3 * floor
            })
            .collect();
        let mut roughness = Roughness::default();
        assert!(roughness.noise().is_none());
        roughness.add(&scan, &simulation, n);
        let noise = roughness.noise().expect("points");
        assert!((noise.additive - 0.3).abs() < 0.06, "{noise:?}");
        assert!((noise.multiplicative - 0.02).abs() < 0.003, "{noise:?}");
    }
}
