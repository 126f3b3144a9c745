//! The air, as Python describes it.

use fieldgap_acoustics::Air;
use fieldgap_input::SoundSpeed;
use fieldgap_records::MediumSection;
use pyo3::prelude::*;

use crate::error::argument_error;

/// The medium that the sound travels through.
///
/// Give either the state of the air or the speed of sound. The speed of sound in air follows Cramer (J. Acoust. Soc. Am. 93, 2510, 1993).
///
/// Parameters
/// ----------
/// temperature_c : float
///     Temperature, degrees Celsius, -20 to 50.
/// humidity : float
///     Relative humidity as a fraction, 0 to 1; without it 0.5.
/// pressure : float
///     Static pressure, Pa, 60e3 to 110e3; without it 101325.
/// speed_of_sound : float
///     Speed of sound, m/s, 100 to 2000.
#[pyclass(frozen, eq, module = "fieldgap", name = "Medium")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PythonMedium {
    pub section: MediumSection,
}

#[pymethods]
impl PythonMedium {
    #[new]
    #[pyo3(signature = (*, temperature_c=None, humidity=None, pressure=None, speed_of_sound=None))]
    fn new(
        temperature_c: Option<f64>,
        humidity: Option<f64>,
        pressure: Option<f64>,
        speed_of_sound: Option<f64>,
    ) -> PyResult<Self> {
        match (temperature_c, speed_of_sound) {
            (None, Some(speed_m_s)) if humidity.is_none() && pressure.is_none() => {
                let speed = SoundSpeed::new(speed_m_s)
                    .map_err(|refused| argument_error(refused.to_string()))?;
                Ok(Self { section: MediumSection::SpeedOfSound(speed) })
            }
            (Some(temperature_c), None) => Self::of_air(
                temperature_c,
                humidity.unwrap_or(HUMIDITY),
                pressure.unwrap_or(PRESSURE_PA),
            ),
            _ => Err(argument_error(
                "a medium needs temperature_c (with humidity and pressure, if known) or speed_of_sound, and not both",
            )),
        }
    }

    /// Speed of sound, m/s.
    #[getter]
    fn speed_of_sound(&self) -> f64 {
        self.section.medium().speed_of_sound_m_s
    }

    /// Temperature, degrees Celsius; None for a medium given by its speed of sound.
    #[getter]
    fn temperature_c(&self) -> Option<f64> {
        self.air().map(|air| air.temperature_c)
    }

    /// Relative humidity as a fraction, 0 to 1; None for a medium given by its speed of sound.
    #[getter]
    fn humidity(&self) -> Option<f64> {
        self.air().map(|air| air.humidity_percent / 100.0)
    }

    /// Static pressure, Pa; None for a medium given by its speed of sound.
    #[getter]
    fn pressure(&self) -> Option<f64> {
        self.air().map(|air| air.pressure_kpa * 1e3)
    }

    /// Wavelength at a frequency in Hz, m.
    #[pyo3(signature = (frequency=40e3))]
    fn wavelength(&self, frequency: f64) -> f64 {
        self.section.medium().wavelength_m(frequency)
    }

    /// Attenuation of the amplitude in the air at a frequency in Hz, Np/m, by ISO 9613-1; for `attenuation` of `simulate`.
    #[pyo3(signature = (frequency=40e3))]
    fn attenuation(&self, frequency: f64) -> PyResult<f64> {
        match self.air() {
            Some(air) => Ok(air.attenuation_np_m(frequency)),
            None => Err(argument_error(
                "the attenuation follows from temperature_c, humidity and pressure; this medium has its speed of sound only",
            )),
        }
    }

    fn __repr__(&self) -> String {
        match self.air() {
            Some(air) => format!(
                "Medium(temperature_c={}, humidity={}, pressure={})",
                air.temperature_c,
                air.humidity_percent / 100.0,
                air.pressure_kpa * 1e3
            ),
            None => format!("Medium(speed_of_sound={})", self.speed_of_sound()),
        }
    }
}

/// Relative humidity where none is given.
const HUMIDITY: f64 = 0.5;

/// Standard atmospheric pressure, Pa.
const PRESSURE_PA: f64 = 101_325.0;

/// Temperature of a medium where none is given, degrees Celsius.
const TEMPERATURE_C: f64 = 20.0;

impl PythonMedium {
    fn of_air(temperature_c: f64, humidity: f64, pressure_pa: f64) -> PyResult<Self> {
        let section = MediumSection::of_air(temperature_c, 100.0 * humidity, pressure_pa / 1e3);
        section.map(|section| Self { section }).ok_or_else(|| {
            argument_error(format!(
                "the formula for the speed of sound in air takes -20 to 50 degrees Celsius, a relative humidity of 0 to 1 and a pressure of \
                 60e3 to 110e3 Pa; given are temperature_c={temperature_c}, humidity={humidity}, pressure={pressure_pa}"
            ))
        })
    }

    /// The air of a room at 20 degrees Celsius, for calls without a medium.
    pub fn of_room() -> PyResult<Self> {
        Self::of_air(TEMPERATURE_C, HUMIDITY, PRESSURE_PA)
    }

    fn air(&self) -> Option<Air> {
        match self.section {
            MediumSection::SpeedOfSound(_) => None,
            MediumSection::Air { temperature_c, humidity_percent, pressure_kpa } => Some(Air {
                temperature_c: temperature_c.get(),
                humidity_percent: humidity_percent.get(),
                pressure_kpa: pressure_kpa.get(),
            }),
        }
    }
}
