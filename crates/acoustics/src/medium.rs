//! The air between array and receiver.

/// The medium that the sound travels through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Speed of sound, metres per second, above zero.
    pub speed_of_sound_m_s: f64,
}

impl Medium {
    /// Air at a temperature (°C, 0 to 30), relative humidity (percent, 0 to 100) and pressure (kPa, 75 to 102), with
    /// 314 ppm of carbon dioxide.
    ///
    /// Source: O. Cramer, "The variation of the specific heat ratio and the speed of sound in air with
    /// temperature, pressure, humidity, and CO2 concentration", J. Acoust. Soc. Am. 93, 2510 (1993), eq. 15,
    /// with the saturation pressure of R. S. Davis, Metrologia 29, 67 (1992). Cramer states an accuracy of 300 ppm.
    pub fn air(temperature_c: f64, humidity_percent: f64, pressure_kpa: f64) -> Self {
        let t = temperature_c;
        let p = pressure_kpa * 1e3;
        let kelvin = t + 273.15;
        let enhancement = 1.00062 + 3.14e-8 * p + 5.6e-7 * t * t;
        let saturation_pa = (1.281_180_5e-5 * kelvin * kelvin - 1.950_987_4e-2 * kelvin
            + 34.049_260_34
            - 6.353_631_1e3 / kelvin)
            .exp();
        let water = humidity_percent / 100.0 * enhancement * saturation_pa / p;
        let carbon_dioxide = 0.000_314;
        let speed_of_sound_m_s = 331.5024 + 0.603_055 * t - 0.000_528 * t * t
            + (51.471_935 + 0.149_587_4 * t - 0.000_782 * t * t) * water
            + (-1.82e-7 + 3.73e-8 * t - 2.93e-10 * t * t) * p
            + (-85.209_31 - 0.228_525 * t + 5.91e-5 * t * t) * carbon_dioxide
            - 2.835_149 * water * water
            - 2.15e-13 * p * p
            + 29.179_762 * carbon_dioxide * carbon_dioxide
            + 0.000_486 * water * p * carbon_dioxide;
        Self { speed_of_sound_m_s }
    }

    /// Wavenumber at a frequency, radians per metre.
    pub fn wavenumber_rad_m(&self, frequency_hz: f64) -> f64 {
        std::f64::consts::TAU * frequency_hz / self.speed_of_sound_m_s
    }

    /// Wavelength at a frequency, metres.
    pub fn wavelength_m(&self, frequency_hz: f64) -> f64 {
        self.speed_of_sound_m_s / frequency_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dry_air_has_the_accepted_speed_of_sound() {
        // 331.45 m/s at 0 °C (Cramer's own check) and 343.4 m/s at 20 °C.
        let at = |t: f64| Medium::air(t, 0.0, 101.325).speed_of_sound_m_s;
        assert!((at(0.0) - 331.45).abs() < 0.05, "{}", at(0.0));
        // Ideal gas: the speed is proportional to the square root of the absolute temperature.
        let ideal = at(0.0) * (293.15f64 / 273.15).sqrt();
        assert!((at(20.0) - ideal).abs() < 0.1, "{} against {ideal}", at(20.0));
    }

    #[test]
    fn sound_is_faster_in_humid_air_by_its_lower_molar_mass() {
        let dry = Medium::air(20.0, 0.0, 101.325).speed_of_sound_m_s;
        let humid = Medium::air(20.0, 100.0, 101.325).speed_of_sound_m_s;
        // Water vapour of 2.34 kPa in 101.325 kPa: c is proportional to 1/sqrt(M), and the ratio of heat capacities falls a little.
        let share = 2.339 / 101.325;
        let mass_ratio: f64 = 1.0 - share * (1.0 - 18.015 / 28.966);
        let bound = dry / mass_ratio.sqrt();
        assert!(humid > dry + 0.8 && humid < bound + 0.05, "{dry} {humid} {bound}");
    }
}
