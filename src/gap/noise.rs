//! The noise of one reading: from repeats, else from silence, else from what the simulation leaves.

use super::comparison::{Noise, NoiseSource};
use crate::acoustics::metrics::PlaneMap;
use crate::scan::{RecordedScan, Repeat, SAME_POINT_MM};

/// Repeats of fewer visits beyond the first than this are too few to judge noise by.
const ENOUGH_REPEATS: usize = 5;

/// Silent readings fewer than this are too few to judge noise by.
const ENOUGH_SILENCE: usize = 5;

impl Noise {
    /// Standard deviation of a reading at a level, both in the reading's unit.
    pub fn at(&self, level: f64) -> f64 {
        self.additive.hypot(self.multiplicative * level)
    }

    /// Judges the noise of a scan; `residual_noise` is what the simulation leaves, in the reading's unit, used where the
    /// scan itself says nothing.
    pub fn of(scan: &RecordedScan, residual_noise: f64) -> Self {
        let silent: Vec<f64> = scan.silent().map(|sample| sample.reading).collect();
        let floor = (silent.len() >= ENOUGH_SILENCE).then(|| spread(&silent));
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
            None => Self {
                additive: residual_noise,
                multiplicative: 0.0,
                source: NoiseSource::Residual,
            },
        }
    }
}

/// The floor is taken from silence; what repeats scatter beyond it is put in proportion to their level. Without a
/// floor, all of it is taken as the same at any level, as one level alone cannot tell.
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
        _ => Noise {
            additive: variance.sqrt(),
            multiplicative: 0.0,
            source: NoiseSource::Repeats,
        },
    })
}

fn spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// The noise of a map's points as the roughness of a residual on it: the rms of its third differences along the rows,
/// over what white noise of unit variance would give (√20).
///
/// A pattern as wide as half a wavelength nearly drops out on a fine grid, white noise stays; what does not drop out
/// makes this an upper bound. `None` where no four neighbours were measured.
pub fn roughness(residual: &PlaneMap) -> Option<f64> {
    let columns = residual.x_m().len();
    let (mut squares, mut count) = (0.0, 0_usize);
    for row in residual.values().chunks(columns) {
        for four in row.windows(4) {
            let third = four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0];
            if !third.is_nan() {
                squares += third * third;
                count += 1;
            }
        }
    }
    (count > 0).then(|| (squares / (20.0 * count as f64)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::Vec3;
    use crate::scan::Sample;

    fn sample(reading: f64) -> Sample {
        Sample::measured(0.0, Some(0), Vec3::zeros(), reading, None)
    }

    fn repeat<'s>(samples: &'s [Sample]) -> Repeat<'s> {
        Repeat { focus: Some(0), position_mm: Vec3::zeros(), samples: samples.iter().collect() }
    }

    #[test]
    fn what_repeats_scatter_beyond_the_floor_goes_with_the_level() {
        // Two levels, each ±2 % about its mean: as variance about the mean 1.2 times (2 % of level)².
        let low: Vec<Sample> = (0..6).map(|i| sample(10.0 + 0.2 * f64::from(1 - 2 * (i % 2)))).collect();
        let high: Vec<Sample> = (0..6).map(|i| sample(100.0 + 2.0 * f64::from(1 - 2 * (i % 2)))).collect();
        let repeats = [repeat(&low), repeat(&high)];
        let noise = from_repeats(&repeats, Some(1e-6)).expect("ten degrees of freedom");
        assert!((noise.multiplicative - 0.02 * 1.2f64.sqrt()).abs() < 1e-9, "{noise:?}");
        let without_floor = from_repeats(&repeats, None).expect("ten degrees of freedom");
        assert_eq!(without_floor.multiplicative, 0.0);
        assert!(from_repeats(&repeats[..0], None).is_none());
    }

    #[test]
    fn roughness_sees_white_noise_and_not_a_slow_pattern() {
        let n = 200;
        let axis: Vec<f64> = (0..n).map(f64::from).collect();
        // A congruence generator with wide multiplier: white enough for third differences.
        let mut state: u64 = 1;
        let mut white = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let values: Vec<f64> =
            (0..n * n).map(|i| 10.0 * (f64::from(i % n) / 20.0).sin() + white()).collect();
        let map = PlaneMap::new(axis.clone(), axis, values).expect("a grid");
        let expected = (1.0f64 / 12.0).sqrt();
        let found = roughness(&map).expect("points");
        assert!((found / expected - 1.0).abs() < 0.03, "{found}");
    }
}
