//! The readings of one transducer's field.

use fieldgap_acoustics::{Air, Vec3};
use fieldgap_records::{MediumSection, RecordedScan, SAME_HEIGHT_MM};

/// Fewest heights: two cannot tell one law on the axis from another.
const LEAST_HEIGHTS: usize = 4;
/// Fewest readings at a height.
const LEAST_AT_A_HEIGHT: usize = 9;

/// Readings of one transducer's field: metres from where its face is believed to be, and the record's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Where, metres.
    pub at_m: Vec<Vec3>,
    /// What was read.
    pub values: Vec<f64>,
    /// To which of `heights_m` each belongs.
    pub height_of: Vec<usize>,
    /// The heights, metres, rising.
    pub heights_m: Vec<f64>,
    /// Unit of the readings.
    pub unit: String,
    /// Drive frequency, Hz.
    pub frequency_hz: f64,
    /// Wavenumber, rad/m.
    pub wavenumber_rad_m: f64,
    /// What ISO 9613-1 says of the air's absorption, Np/m, and whether the record says what air it was; else it is that of
    /// 20 °C and 50 %.
    pub air_np_m: (f64, bool),
    /// How many readings lie too low and are left out.
    pub left_out: usize,
}

/// Why a scan says nothing of a transducer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CharacterizationError {
    /// An array was scanned.
    #[error(
        "the scan is of an array of {0} elements; a transducer is characterized by a scan of it alone"
    )]
    NotAlone(usize),
    /// Too few planes.
    #[error(
        "{LEAST_AT_A_HEIGHT} readings or more were taken at only {heights} heights from {from_mm} mm on; at least \
         {LEAST_HEIGHTS} are needed"
    )]
    TooFewHeights {
        /// Heights with enough readings.
        heights: usize,
        /// From where on they count, millimetres.
        from_mm: f64,
    },
    /// Every reading is alike.
    #[error("every reading is alike: nothing was heard")]
    Silent,
    /// No pair of laws explains the readings.
    #[error(
        "no model explains half of the readings' variance; is there a lone transducer under the scan, and are heights \
         counted from its face?"
    )]
    NoFit,
}

impl Readings {
    /// The readings of a recorded scan, from a height on, millimetres over the transducer's face.
    ///
    /// # Errors
    /// [`CharacterizationError`] if an array was scanned, or too few heights.
    pub fn of(scan: &RecordedScan, from_mm: f64) -> Result<Self, CharacterizationError> {
        let elements = scan.setup.array.array().elements();
        let [element] = elements else {
            return Err(CharacterizationError::NotAlone(elements.len()));
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
        // Drives differ in phase alone where there is one element: every one counts.
        let samples: Vec<_> = scan
            .samples
            .iter()
            .filter(|sample| sample.focus.is_some())
            .map(|sample| fieldgap_records::RecordedSample { focus: Some(0), ..*sample })
            .collect();
        for plane in fieldgap_records::planes(&samples, SAME_HEIGHT_MM) {
            let height_m = plane.z_mm * 1e-3 - element.centre_m.z;
            if height_m < from_mm * 1e-3 - 1e-9 || plane.samples.len() < LEAST_AT_A_HEIGHT {
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
        if readings.heights_m.len() < LEAST_HEIGHTS {
            let heights = readings.heights_m.len();
            return Err(CharacterizationError::TooFewHeights { heights, from_mm });
        }
        if readings.values.windows(2).all(|pair| pair[0] == pair[1]) {
            return Err(CharacterizationError::Silent);
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
