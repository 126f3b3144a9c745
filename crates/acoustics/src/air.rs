//! The speed of sound in air and its attenuation, from temperature, humidity and pressure.

use super::Medium;

/// Reference temperature of ISO 9613-1, K.
const REFERENCE_K: f64 = 293.15;
/// Triple point of water, K.
const TRIPLE_POINT_K: f64 = 273.16;
/// Reference pressure of ISO 9613-1, kPa.
const REFERENCE_KPA: f64 = 101.325;

/// The state of the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Relative humidity, percent, 0 to 100.
    pub humidity_percent: f64,
    /// Pressure, kPa, above zero.
    pub pressure_kpa: f64,
}

impl Air {
    /// The medium with the speed of sound by Cramer's formula ([`Medium::air`]).
    pub fn medium(&self) -> Medium {
        Medium::air(self.temperature_c, self.humidity_percent, self.pressure_kpa)
    }

    /// Pure-tone attenuation of the amplitude at a frequency (Hz, above zero), dB/m.
    ///
    /// Source: ISO 9613-1:1993, equations 3 to 5 and B.2, B.3: shear and heat conduction, and the relaxations of oxygen and
    /// nitrogen. The standard states an accuracy of 10 % from -20 to 50 °C, for 0.05 to 5 % of water vapour, below 200 kPa, and for
    /// 4e-4 to 10 Hz/Pa as the ratio of frequency to pressure: 40 Hz to 1 MHz at one atmosphere.
    pub fn attenuation_db_m(&self, frequency_hz: f64) -> f64 {
        let kelvin = self.temperature_c + 273.15;
        let relative_temperature = kelvin / REFERENCE_K;
        let pressure = self.pressure_kpa / REFERENCE_KPA;
        let saturation = 10f64.powf(4.6151 - 6.8346 * (TRIPLE_POINT_K / kelvin).powf(1.261));
        let water_percent = self.humidity_percent * saturation / pressure;
        let oxygen_hz = pressure
            * (24.0 + 4.04e4 * water_percent * (0.02 + water_percent) / (0.391 + water_percent));
        let nitrogen_hz = pressure / relative_temperature.sqrt()
            * (9.0
                + 280.0
                    * water_percent
                    * (-4.170 * (relative_temperature.cbrt().recip() - 1.0)).exp());
        let square = frequency_hz * frequency_hz;
        let relaxation = |strength: f64, kelvin_of_mode: f64, relaxation_hz: f64| {
            strength * (-kelvin_of_mode / kelvin).exp() / (relaxation_hz + square / relaxation_hz)
        };
        8.686
            * square
            * (1.84e-11 / pressure * relative_temperature.sqrt()
                + relative_temperature.powf(-2.5)
                    * (relaxation(0.01275, 2239.1, oxygen_hz)
                        + relaxation(0.1068, 3352.0, nitrogen_hz)))
    }

    /// Attenuation of the amplitude at a frequency (Hz, above zero), Np/m. Source as for [`Air::attenuation_db_m`].
    pub fn attenuation_np_m(&self, frequency_hz: f64) -> f64 {
        self.attenuation_db_m(frequency_hz) * std::f64::consts::LN_10 / 20.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn air(temperature_c: f64, humidity_percent: f64) -> Air {
        Air { temperature_c, humidity_percent, pressure_kpa: 101.325 }
    }

    #[test]
    fn attenuation_agrees_with_the_standards_table_to_its_last_digit() {
        // ISO 9613-2:1996, table 2: coefficients by ISO 9613-1 at the octaves' exact mid-frequencies, dB/km.
        let tabled = [
            (10.0, 70.0, [0.1, 0.4, 1.0, 1.9, 3.7, 9.7, 32.8, 117.0]),
            (20.0, 70.0, [0.1, 0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6]),
            (30.0, 70.0, [0.1, 0.3, 1.0, 3.1, 7.4, 12.7, 23.1, 59.3]),
            (15.0, 20.0, [0.3, 0.6, 1.2, 2.7, 8.2, 28.2, 88.8, 202.0]),
            (15.0, 50.0, [0.1, 0.5, 1.2, 2.2, 4.2, 10.8, 36.2, 129.0]),
            (15.0, 80.0, [0.1, 0.3, 1.1, 2.4, 4.1, 8.3, 23.7, 82.8]),
        ];
        for (temperature_c, humidity_percent, row) in tabled {
            for (octave, tabled) in row.into_iter().enumerate() {
                let frequency_hz = 1e3 * 10f64.powf(0.3 * (octave as f64 - 4.0));
                let ours =
                    1e3 * air(temperature_c, humidity_percent).attenuation_db_m(frequency_hz);
                let digit = if tabled >= 100.0 { 1.0 } else { 0.1 };
                assert!(
                    (ours - tabled).abs() < 0.6 * digit,
                    "{temperature_c} {humidity_percent} {frequency_hz}: {ours} {tabled}"
                );
            }
        }
    }

    #[test]
    fn air_at_room_temperature_attenuates_40_khz_by_1_318_db_per_metre() {
        let room = air(20.0, 50.0);
        assert!(
            (room.attenuation_db_m(40e3) - 1.318).abs() < 5e-4,
            "{}",
            room.attenuation_db_m(40e3)
        );
        let np_m = room.attenuation_np_m(40e3);
        assert!(((-np_m).exp() - 10f64.powf(-1.318 / 20.0)).abs() < 1e-4);
    }

    #[test]
    fn cramers_speed_of_sound_agrees_with_iso_9613_1_at_room_temperature() {
        // ISO 9613-1, A.3: c = 343.2 sqrt(T/T0), for air of ordinary humidity.
        for temperature_c in [15.0, 20.0, 25.0] {
            let iso = 343.2 * ((temperature_c + 273.15f64) / REFERENCE_K).sqrt();
            let cramer = air(temperature_c, 10.0).medium().speed_of_sound_m_s;
            assert!((cramer - iso).abs() < 0.5, "{temperature_c}: {cramer} {iso}");
        }
    }
}
