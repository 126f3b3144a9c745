//! The level of one element on its axis, and where it comes from.

use std::fmt;

use serde::Serialize;

use fieldgap_level::{Kind, Line, of_level_pa};

/// Distance at which data sheets of 40 kHz transducers state a level, m.
const STATED_AT_M: f64 = 0.3;

/// The level of a transducer by its data sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSheet {
    /// Whose.
    pub of: String,
    /// Level on the axis at 0.3 m, dB re 20 µPa rms.
    pub db_at_300_mm: f64,
    /// Drive at which it is stated, V rms at the carrier.
    pub at_v_rms: f64,
    /// Drive of the array, V rms at the carrier.
    pub drive_v_rms: f64,
    /// Standard uncertainty of the level of the sheet, dB.
    pub u_db: f64,
    /// Standard uncertainty of the drive, percent.
    pub drive_u_percent: f64,
}

/// Sound pressure of a nominal element on its axis, with its uncertainty and where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceLevel {
    /// Pressure on the axis of a nominal element times its distance, without absorption, Pa rms m: that at 1 m.
    pub pa_m: f64,
    /// Where it comes from, in words.
    pub origin: String,
    /// Its uncertainty.
    pub lines: Vec<Line>,
}

impl DataSheet {
    /// The level at the drive of the array, in air of an attenuation, Np/m. The pressure is taken as proportional to the voltage.
    pub fn source_level(&self, attenuation_np_m: f64) -> SourceLevel {
        let Self { db_at_300_mm, at_v_rms, drive_v_rms, .. } = *self;
        let stated_pa = of_level_pa(db_at_300_mm) * (attenuation_np_m * STATED_AT_M).exp();
        SourceLevel {
            pa_m: stated_pa * STATED_AT_M * drive_v_rms / at_v_rms,
            origin: self.to_string(),
            lines: vec![
                Line::decibels("level by the data sheet", Kind::B, self.u_db),
                Line::relative("drive voltage", Kind::B, self.drive_u_percent / 100.0),
            ],
        }
    }
}

impl fmt::Display for DataSheet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { of, db_at_300_mm, at_v_rms, drive_v_rms, .. } = self;
        write!(
            f,
            "data sheet of {of}: {db_at_300_mm} dB at 0.3 m and {at_v_rms} V rms, driven with {drive_v_rms} V rms"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_voltage_is_six_decibels_less() {
        let sheet = DataSheet {
            of: "Murata MA40S4S".to_owned(),
            db_at_300_mm: 120.0,
            at_v_rms: 10.0,
            drive_v_rms: 5.0,
            u_db: 1.5,
            drive_u_percent: 2.0,
        };
        let level = sheet.source_level(0.0);
        assert!((level.pa_m - 3.0).abs() < 1e-9);
        let absorbing = sheet.source_level(0.15);
        assert!((absorbing.pa_m * (-0.15f64 * 0.3).exp() / 0.3 - 10.0).abs() < 1e-9);
        assert_eq!(
            level.origin,
            "data sheet of Murata MA40S4S: 120 dB at 0.3 m and 10 V rms, driven with 5 V rms"
        );
        assert!((level.lines[1].contribution_db - 0.1737).abs() < 1e-4);
    }
}
