//! The readings of one transducer's field.

use fieldgap_acoustics::{Air, Vec3};
use fieldgap_records::{MediumSection, RecordedScan, SAME_HEIGHT_MM};

/// Fewest heights: with two, the laws on the axis cannot be distinguished.
const MIN_HEIGHTS: usize = 4;
/// Fewest readings at a height.
const MIN_READINGS_PER_HEIGHT: usize = 9;

/// Readings of the field of one transducer: positions relative to the assumed centre of its face, and levels in the record's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Positions, metres.
    pub at_m: Vec<Vec3>,
    /// Readings.
    pub values: Vec<f64>,
    /// The index in `heights_m` of each reading.
    pub height_of: Vec<usize>,
    /// The heights, metres, ascending.
    pub heights_m: Vec<f64>,
    /// Unit of the readings.
    pub unit: String,
    /// Drive frequency, Hz.
    pub frequency_hz: f64,
    /// Wavenumber, rad/m.
    pub wavenumber_rad_m: f64,
    /// Attenuation of the air by ISO 9613-1, Np/m, and whether the record gives the state of the air; otherwise it is that at 20 °C and
    /// 50 %.
    pub air_np_m: (f64, bool),
    /// Number of readings left out: below the lowest height, or at a height with too few.
    pub left_out: usize,
}

/// Why a transducer cannot be characterized from a scan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CharacterizationError {
    /// An array was scanned.
    #[error(
        "the scan is of an array of {0} elements; a transducer is characterized from a scan of a single one"
    )]
    SeveralElements(usize),
    /// Too few planes.
    #[error(
        "only {heights} heights from {from_mm} mm have {MIN_READINGS_PER_HEIGHT} readings or more; at least {MIN_HEIGHTS} are needed"
    )]
    TooFewHeights {
        /// Heights with enough readings.
        heights: usize,
        /// The lowest height used, millimetres.
        from_mm: f64,
    },
    /// All readings are equal.
    #[error("all readings are equal: there is no signal")]
    NoSignal,
    /// No pair of laws explains the readings.
    #[error(
        "no model explains half of the variance of the readings; was a single transducer scanned, and are heights relative to its face?"
    )]
    NoFit,
}

impl Readings {
    /// The readings of a recorded scan from a height above the transducer's face, mm.
    ///
    /// # Errors
    /// [`CharacterizationError`] if an array was scanned, or too few heights, or if all readings are equal.
    pub fn of(scan: &RecordedScan, from_mm: f64) -> Result<Self, CharacterizationError> {
        let elements = scan.setup.array.array().elements();
        let [element] = elements else {
            return Err(CharacterizationError::SeveralElements(elements.len()));
        };
        let medium = &scan.setup.medium;
        let frequency_hz = scan.setup.array.frequency_hz();
        let mut readings = Self {
            at_m: Vec::new(),
            values: Vec::new(),
            height_of: Vec::new(),
            heights_m: Vec::new(),
            unit: scan.setup.unit.clone(),
            frequency_hz,
            wavenumber_rad_m: medium.medium().wavenumber_rad_m(frequency_hz),
            air_np_m: absorption(medium, frequency_hz),
            left_out: 0,
        };
        // With one element, drives differ only in phase: all are used.
        let samples: Vec<_> = scan
            .samples
            .iter()
            .filter(|sample| sample.focus.is_some())
            .map(|sample| fieldgap_records::RecordedSample { focus: Some(0), ..*sample })
            .collect();
        for plane in fieldgap_records::planes(&samples, SAME_HEIGHT_MM) {
            let height_m = plane.z_mm * 1e-3 - element.centre_m.z;
            if height_m < from_mm * 1e-3 - 1e-9 || plane.samples.len() < MIN_READINGS_PER_HEIGHT {
                readings.left_out += plane.samples.len();
                continue;
            }
            for sample in &plane.samples {
                readings.at_m.push(sample.position_m() - element.centre_m);
                readings.values.push(sample.reading);
                readings.height_of.push(readings.heights_m.len());
            }
            readings.heights_m.push(height_m);
        }
        if readings.heights_m.len() < MIN_HEIGHTS {
            let heights = readings.heights_m.len();
            return Err(CharacterizationError::TooFewHeights { heights, from_mm });
        }
        if readings.values.windows(2).all(|pair| pair[0] == pair[1]) {
            return Err(CharacterizationError::NoSignal);
        }
        Ok(readings)
    }

    /// The largest reading.
    pub fn largest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }
}

fn absorption(medium: &MediumSection, frequency_hz: f64) -> (f64, bool) {
    let (air, known) = match *medium {
        MediumSection::Air { temperature_c, humidity_percent, pressure_kpa } => (
            Air {
                temperature_c: temperature_c.get(),
                humidity_percent: humidity_percent.get(),
                pressure_kpa: pressure_kpa.get(),
            },
            true,
        ),
        MediumSection::SpeedOfSound(_) => {
            (Air { temperature_c: 20.0, humidity_percent: 50.0, pressure_kpa: 101.325 }, false)
        }
    };
    (air.attenuation_np_m(frequency_hz), known)
}
