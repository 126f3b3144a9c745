//! The scale on which readings have a standard deviation of one everywhere: z(r) = ∫ dr / σ(r).
//!
//! For proportional and quadrature noise the integral is asinh(a r / b) / a. Where the level is below the noise the magnitude scatters
//! less than its quadratures do; the difference of the integral is tabulated.

use fieldgap_comparison::{OF_NOISE_ALONE, lost_in_noise, rice_mean};

/// Least proportional noise: below it the transform loses digits.
pub(crate) const LEAST_SHARE: f64 = 1e-4;

/// Reading, in quadrature standard deviations, up to which the smaller scatter of the magnitude is tabulated, and the number of cells.
const TABULATED: f64 = 16.0;
const CELLS: usize = 128;

/// Levels are tabulated over the level plus one quadrature standard deviation: cells in each octave, and octaves.
const CELLS_IN_OCTAVE: u64 = 64;
const OCTAVES: u64 = 16;

/// Bits of a number below those that tell its cell.
const WITHIN_CELL: u32 = f64::MANTISSA_DIGITS - 1 - CELLS_IN_OCTAVE.trailing_zeros();

/// A scale for one share and one quadrature's standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseScale {
    share: f64,
    additive: f64,
    /// Standard deviation of a quadrature of one of the magnitudes that a reading is the mean of.
    single: f64,
    /// The tabulated difference of the integral at the beginning of each cell, and its slope there.
    lesser: Vec<[f64; 2]>,
    /// For the level at the beginning of each cell: its mean reading on the scale, and the slope there.
    by_level: Vec<[f64; 2]>,
}

impl NoiseScale {
    /// Of readings with noise in proportion to the level and in quadrature, in the reading's unit, each the mean of so many
    /// magnitudes.
    pub fn new(share: f64, additive: f64, averaged: f64) -> Self {
        let (share, single) = (share.max(LEAST_SHARE), additive * averaged.sqrt());
        let mut scale = Self { share, additive, single, lesser: Vec::new(), by_level: Vec::new() };
        let width = TABULATED * single / CELLS as f64;
        let slope =
            |reading: f64| 1.0 / scale.deviation(reading) - 1.0 / scale.of_quadratures(reading);
        let mut sum = 0.0;
        scale.lesser = (0..=CELLS)
            .map(|cell| {
                let from = cell as f64 * width;
                let entry = [sum, slope(from)];
                sum += width / 6.0
                    * (entry[1] + 4.0 * slope(from + 0.5 * width) + slope(from + width));
                entry
            })
            .collect();
        let first = single.to_bits() >> WITHIN_CELL;
        scale.by_level = (0..=CELLS_IN_OCTAVE * OCTAVES)
            .map(|cell| {
                let begin = f64::from_bits((first + cell) << WITHIN_CELL);
                let (level, step) = (begin - single, 1e-5 * begin);
                let [below, at, above] = [level - step, level, level + step]
                    .map(|level| scale.of(rice_mean(level, single)));
                [at, (above - below) / (2.0 * step)]
            })
            .collect();
        scale
    }

    /// The mean reading of a level, on the scale, and its slope by the level's logarithm.
    ///
    /// From a table, to a thousandth of a standard deviation, because it is evaluated millions of times.
    #[inline]
    pub fn of_level(&self, level: f64) -> (f64, f64) {
        let above = level + self.single;
        let first = self.single.to_bits() >> WITHIN_CELL;
        let cell = (above.to_bits() >> WITHIN_CELL).wrapping_sub(first) as usize;
        let Some([[from, from_slope], [to, to_slope]]) = self.by_level.get(cell..cell + 2) else {
            let reading = rice_mean(level, self.single);
            return (self.of(reading), reading * self.slope(reading));
        };
        let begin = f64::from_bits((first + cell as u64) << WITHIN_CELL);
        let width = f64::from_bits((first + cell as u64 + 1) << WITHIN_CELL) - begin;
        let (t, rise) = ((above - begin) / width, to - from);
        let u = 1.0 - t;
        let bends = [width * from_slope - rise, rise - width * to_slope];
        let value = from + t * rise + t * u * (u * bends[0] + t * bends[1]);
        let slope = rise + (u - t) * (u * bends[0] + t * bends[1]) + t * u * (bends[1] - bends[0]);
        (value, level * slope / width)
    }

    /// A reading on the scale.
    pub fn of(&self, reading: f64) -> f64 {
        let x = self.share * reading / self.additive;
        // asinh for arguments above zero; the library's keeps the last digits near zero but takes twice the time.
        (x + (x * x + 1.0).sqrt()).ln() / self.share + self.lesser(reading)
    }

    /// Slope of the scale at a reading.
    pub fn slope(&self, reading: f64) -> f64 {
        1.0 / self.deviation(reading)
    }

    /// Standard deviation of readings with this mean.
    pub fn deviation(&self, mean: f64) -> f64 {
        let relative = mean / self.single;
        if relative > TABULATED {
            return self.of_quadratures(mean);
        }
        let proportional = self.share * mean;
        let quadrature = self.additive * self.additive * (1.0 - lost_with_mean(relative));
        (proportional * proportional + quadrature).sqrt()
    }

    fn of_quadratures(&self, mean: f64) -> f64 {
        let proportional = self.share * mean;
        (proportional * proportional + self.additive * self.additive).sqrt()
    }

    /// Cubic between the cells' ends.
    fn lesser(&self, reading: f64) -> f64 {
        let width = TABULATED * self.single / CELLS as f64;
        let at = reading / width;
        if at >= CELLS as f64 {
            return self.lesser[CELLS][0];
        }
        let cell = at as usize;
        let t = at - cell as f64;
        let ([from, from_slope], [to, to_slope]) = (self.lesser[cell], self.lesser[cell + 1]);
        let (u, rise) = (1.0 - t, to - from);
        from + t * t * (3.0 - 2.0 * t) * rise + width * t * u * (u * from_slope - t * to_slope)
    }
}

/// [`lost_in_noise`] of the level whose readings have this mean, in quadratures' standard deviations.
pub(crate) fn lost_with_mean(mean: f64) -> f64 {
    if mean <= OF_NOISE_ALONE {
        return lost_in_noise(0.0, 1.0);
    }
    // The level's power u solves u + 1 + 0.5708 / (1 + 0.434 u) = mean².
    let above = 1.0 - mean * mean;
    let b = 1.0 + 0.434 * above;
    let u = (-b + (b * b - 4.0 * 0.434 * (above + 0.5708)).max(0.0).sqrt()) / (2.0 * 0.434);
    lost_in_noise(u.max(0.0).sqrt(), 1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn levels_are_looked_up_as_their_mean_readings_are(
            power in -3.0..4.5f64, share in 0.0..0.05f64, averaged in 1.0..50.0f64,
        ) {
            let (level, step) = (10f64.powf(power), 1e-5);
            let scale = NoiseScale::new(share, 0.7, averaged);
            let expected = |level: f64| scale.of(rice_mean(level, scale.single));
            let (value, by_logarithm) = scale.of_level(level);
            prop_assert!((value - expected(level)).abs() < 1e-3, "{value} {}", expected(level));
            let slope = (expected(level * (1.0 + step)) - expected(level * (1.0 - step))) / (2.0 * step);
            prop_assert!((by_logarithm - slope).abs() < 5e-3 * (1.0 + slope.abs()), "{by_logarithm} {slope}");
        }

        #[test]
        fn its_slope_is_one_over_the_deviation(reading in 0.0..40.0f64, share in 0.0..0.05f64) {
            let scale = NoiseScale::new(share, 0.7, 1.0);
            let step = 1e-4;
            let slope = (scale.of(reading + step) - scale.of(reading)) / step;
            let expected = scale.slope(reading + 0.5 * step);
            prop_assert!((slope / expected - 1.0).abs() < 0.02, "{slope} {expected}");
        }

        #[test]
        fn a_level_scatters_as_its_moments_say(level in 0.0..11.0f64) {
            let scale = NoiseScale::new(0.0, 1.0, 1.0);
            let mean = rice_mean(level, 1.0);
            let variance = level * level + 2.0 - mean * mean;
            prop_assert!((scale.deviation(mean) / variance.sqrt() - 1.0).abs() < 1e-3);
        }
    }

    /// Rayleigh's deviation is √(2 - π/2) of a quadrature's.
    #[test]
    fn silence_scatters_as_rayleigh_says() {
        let of_rayleigh = (2.0 - 0.5 * std::f64::consts::PI).sqrt();
        assert!((NoiseScale::new(0.02, 1.0, 1.0).deviation(0.0) - of_rayleigh).abs() < 1e-4);
    }
}
