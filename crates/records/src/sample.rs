//! One row of a record: position, drive and reading.

use fieldgap_acoustics::Vec3;

/// Millimetres are rounded to the nanometre, so that a position in metres gives the expected digits (17.5, not 17.500000000000004).
/// No robot positions to this accuracy.
const PER_MM: f64 = 1e6;

/// A length in metres as millimetres, to the nanometre.
pub fn millimetres(metres: f64) -> f64 {
    (metres * 1e3 * PER_MM).round() / PER_MM
}

/// One reading, as a row of `samples.csv` holds it.
///
/// The position is in millimetres as in the file, so that a record does not change when it is read and written;
/// [`RecordedSample::position_m`] is in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedSample {
    /// Seconds on the recorder's clock, any origin.
    pub time_s: f64,
    /// Number of the `[[focus]]` that was driven; `None` if the array was silent.
    pub focus: Option<usize>,
    /// Position reported by the robot, millimetres, array frame.
    pub position_mm: Vec3,
    /// Magnitude, zero or above, in the record's unit.
    pub reading: f64,
    /// Phase, rad, against the reference and in the convention of the record's [`PhaseSection`](super::PhaseSection), where it was measured.
    pub phase_rad: Option<f64>,
    /// Spread of the single readings, where the receiver gives it.
    pub spread: Option<Spread>,
}

/// The spread of the single readings that were averaged into one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation of the single readings, zero or above, in the record's unit.
    pub std: f64,
    /// How many readings were averaged; at least one.
    pub count: u32,
}

impl RecordedSample {
    /// A sample without a phase at a position in metres (array frame), rounded to the nanometre.
    pub fn measured(
        time_s: f64,
        focus: Option<usize>,
        position_m: Vec3,
        reading: f64,
        spread: Option<Spread>,
    ) -> Self {
        let position_mm = position_m.map(millimetres);
        Self { time_s, focus, position_mm, reading, phase_rad: None, spread }
    }

    /// The same with a phase, rad.
    pub fn with_phase(self, phase_rad: Option<f64>) -> Self {
        Self { phase_rad, ..self }
    }

    /// Position reported by the robot, metres, array frame.
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
