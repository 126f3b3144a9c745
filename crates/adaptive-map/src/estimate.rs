//! What a map says of a place, whatever process it comes from.

use nalgebra::DMatrix;

use fieldgap_diagnosis::PossibleReading;

/// The amplitude at a place of the map, as the receiver would read it without noise, in the unit of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The amplitude; zero or above.
    pub amplitude: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// What is expected of a reading before it is taken, in the unit of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foretold {
    /// The mean reading.
    pub reading: f64,
    /// Standard error of that mean.
    pub standard_error: f64,
    /// Standard deviation of the reading's noise.
    pub noise: f64,
}

/// A field after some readings.
pub(crate) trait FieldEstimate: Sync {
    /// The amplitudes at places of the map.
    fn map(&self, places: &[PossibleReading]) -> Vec<Estimate>;

    /// What readings at these places would be, at a moment of the scan: 0 at its first reading, 1 at its last, more for those that follow.
    fn foretold(&self, places: &[PossibleReading], moment: f64) -> Vec<Foretold>;

    /// Covariance of the amplitudes at some targets with those of some possible readings: a row for each target.
    fn covariance(&self, targets: &[PossibleReading], possible: &[PossibleReading])
    -> DMatrix<f64>;
}
