//! One row of a record: where the robot stood, what was driven, what the receiver read.

use fieldgap_acoustics::Vec3;

/// Millimetres are kept to the nanometre, so that metres turned into millimetres read as they were meant
/// (17.5, not 17.500000000000004); no robot knows where it is to a thousandth of that.
const PER_MM: f64 = 1e6;

/// Millimetres of a length in metres, to the nanometre.
pub fn millimetres(metres: f64) -> f64 {
    (metres * 1e3 * PER_MM).round() / PER_MM
}

/// One reading, as a row of `samples.csv` holds it.
///
/// The position is kept in the file's own millimetres, so that a record read and written again stays the same
/// to the last bit; [`RecordedSample::position_m`] gives it to whoever computes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedSample {
    /// Seconds on the recorder's clock, any origin.
    pub time_s: f64,
    /// Number of the `[[focus]]` that was driven; none if the array was silent.
    pub focus: Option<usize>,
    /// Where the robot said it was, millimetres, array frame.
    pub position_mm: Vec3,
    /// Magnitude, zero or above, in the record's unit.
    pub reading: f64,
    /// How the readings behind it were spread, where the receiver gives it.
    pub spread: Option<Spread>,
}

/// How the readings that were averaged into one sample were spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation of the single readings, zero or above, in the record's unit.
    pub std: f64,
    /// How many readings were averaged; at least one.
    pub count: u32,
}

impl RecordedSample {
    /// A sample taken at a position in metres (array frame), kept to the nanometre.
    pub fn measured(
        time_s: f64,
        focus: Option<usize>,
        position_m: Vec3,
        reading: f64,
        spread: Option<Spread>,
    ) -> Self {
        Self { time_s, focus, position_mm: position_m.map(millimetres), reading, spread }
    }

    /// Where the robot said it was, metres, array frame.
    pub fn position_m(&self) -> Vec3 {
        self.position_mm / 1e3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn a_position_set_in_tenths_of_a_micrometre_is_recorded_as_set(steps in -10_000_000i64..10_000_000) {
            let millimetre = steps as f64 / 1e4;
            let sample = RecordedSample::measured(0.0, None, Vec3::repeat(millimetre / 1e3), 0.0, None);
            proptest::prop_assert_eq!(sample.position_mm, Vec3::repeat(millimetre));
        }
    }
}
