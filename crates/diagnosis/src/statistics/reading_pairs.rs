//! Differences of two readings of one level, whose variance tells how readings scatter.

use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::noise_scale::lost_with_mean;

/// What of the detector changes how noise scatters a reading; by default nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Detector {
    /// A floor that it adds in power after quadrature noise, in the reading's unit; zero for none.
    pub floor: f64,
    /// Whether noise in proportion to the level comes in before it too.
    pub after_all_noise: bool,
}

/// How far a detector compresses a level. A floor is not part of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Compression {
    /// Slope of the reading by the level.
    pub slope: f64,
    /// Slope of the reading's logarithm by that of the level.
    pub of_logarithms: f64,
}

impl Compression {
    pub const NONE: Self = Self { slope: 1.0, of_logarithms: 1.0 };
}

/// The level that a reading had before a floor was added in power.
pub(crate) fn without_floor(reading: f64, floor: f64) -> f64 {
    (reading * reading - floor * floor).max(0.0).sqrt()
}

/// An expected reading, and its scatter for one unit of a fluctuation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    /// In the reading's unit, any floor included.
    pub reading: f64,
    /// Mean squares along the steady part and across it, in the unit squared, for turbulence of one rad over one metre of path.
    pub by_turbulence: [f64; 2],
    /// The same for a scatter of the position of one millimetre along each axis.
    pub by_jitter: [f64; 2],
    pub compression: Compression,
}

impl Level {
    /// Mean squares along and across for a unit of this fluctuation.
    fn of(&self, cause: Fluctuation) -> [f64; 2] {
        match cause {
            Fluctuation::OfPaths | Fluctuation::Circular => self.by_turbulence,
            Fluctuation::OfPosition => self.by_jitter,
        }
    }
}

/// The difference of two readings of one point beyond the expected difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    level: Level,
    /// Slope of the reading by the level before the floor was added; one without a floor.
    beside_floor: f64,
    /// What the detector leaves of noise in proportion to the level, relative to the reading.
    of_share: f64,
    averaged: f64,
    difference: f64,
}

impl Pair {
    pub fn new(level: Level, averaged: f64, detector: Detector, difference: f64) -> Self {
        let Detector { floor, after_all_noise } = detector;
        let beside_floor = match floor > 0.0 {
            true => without_floor(level.reading, floor) / level.reading.max(floor),
            false => 1.0,
        };
        // Of √(l² + f²) the slope of the logarithms is the square of that of the numbers.
        let of_share = match after_all_noise {
            true => level.compression.of_logarithms * beside_floor.powi(2),
            false => 1.0,
        };
        Self { level, beside_floor, of_share, averaged, difference }
    }

    /// The square of the difference.
    pub fn square(&self) -> f64 {
        self.difference * self.difference
    }

    /// Variance of the difference, and its slopes by the squares of share, additive part and fluctuation.
    pub fn variance_and_slopes(&self, squares: [f64; 3], cause: Fluctuation) -> (f64, [f64; 3]) {
        /// Step of the difference quotient, as a share of the square that doubles the variance.
        const STEP: f64 = 1e-4;
        let variance = self.variance(squares, cause);
        let [along, across] = self.level.of(cause);
        let whole = 0.5 * variance;
        let power = (self.level.reading * self.level.reading).max(squares[1]);
        let sizes = [whole / power, whole, whole / (along + across).max(f64::MIN_POSITIVE)];
        let slopes = std::array::from_fn(|n| {
            let mut beside = squares;
            beside[n] += STEP * sizes[n];
            (self.variance(beside, cause) - variance) / (STEP * sizes[n])
        });
        (variance, slopes)
    }

    /// Negative logarithm of its likelihood, less a constant, given the squares of share, additive part and fluctuation.
    pub fn cost(&self, squares: [f64; 3], cause: Fluctuation) -> f64 {
        let variance = self.variance(squares, cause);
        0.5 * (variance.ln() + self.difference * self.difference / variance)
    }

    /// Variance of the difference, given the squares of share, additive part and fluctuation.
    fn variance(&self, [share2, additive2, fluctuation2]: [f64; 3], cause: Fluctuation) -> f64 {
        let reading = self.level.reading;
        let [along, across] = self.level.of(cause);
        let (m2, beside2) = (reading * reading, self.beside_floor * self.beside_floor);
        let mean = additive2 + 0.5 * fluctuation2 * (along + across);
        let along = match cause {
            Fluctuation::OfPaths | Fluctuation::OfPosition => additive2 + fluctuation2 * along,
            Fluctuation::Circular => mean,
        };
        // Near a null the magnitude has Rayleigh's scatter, less than its quadratures.
        let lost = lost_with_mean((beside2 * m2 / (self.averaged * mean)).sqrt());
        let quadrature =
            along + lost / lost_with_mean(0.0) * ((1.0 - lost_with_mean(0.0)) * mean - along);
        // A reading of the floor alone has nearly no scatter.
        let in_proportion = share2 * m2 * self.of_share * self.of_share;
        let of_quadrature = beside2 * self.level.compression.slope.powi(2);
        2.0 * (in_proportion + of_quadrature * quadrature).max(1e-6 * additive2)
    }
}

/// Negative logarithm of the likelihood of pairs, each a difference of two readings.
pub(crate) fn cost(
    pairs: &[Pair],
    share: f64,
    additive: f64,
    fluctuation: f64,
    cause: Fluctuation,
) -> f64 {
    let squares = [share, additive, fluctuation].map(|root| root * root);
    pairs.iter().map(|pair| pair.cost(squares, cause)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A converter with coarse steps gives the same reading, zero or the floor, at every visit of a null.
    #[test]
    fn two_visits_that_read_nothing_or_the_floor_alone_leave_the_noise_a_number() {
        for floor in [0.0, 0.2] {
            let level = Level {
                reading: floor,
                by_turbulence: [0.0; 2],
                by_jitter: [0.0; 2],
                compression: Compression::NONE,
            };
            let detector = Detector { floor, after_all_noise: false };
            let pair = Pair::new(level, 1.0, detector, 0.0);
            let cost = cost(&[pair], 0.0, 0.1, 0.0, Fluctuation::OfPaths);
            assert!(cost.is_finite(), "{floor}: {cost}");
        }
    }
}
