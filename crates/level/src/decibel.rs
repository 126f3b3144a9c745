//! Sound pressure levels.

/// Reference of sound pressure levels in air, Pa rms (ISO 1683).
pub const REFERENCE_PA: f64 = 20e-6;

/// Decibels of a relative change of an amplitude, per unit: 20/ln 10.
pub const DB_PER_NEPER: f64 = 20.0 / std::f64::consts::LN_10;

/// Level of a sound pressure in air, dB re 20 µPa.
pub fn level_db(rms_pa: f64) -> f64 {
    20.0 * (rms_pa / REFERENCE_PA).log10()
}

/// The sound pressure of a level, Pa rms.
pub fn of_level_pa(level_db: f64) -> f64 {
    REFERENCE_PA * 10f64.powf(level_db / 20.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_those_of_the_standard() {
        // 1 Pa is 94 dB; the data sheet's 120 dB are 20 Pa.
        assert!((level_db(1.0) - 93.979).abs() < 1e-3);
        assert!((of_level_pa(120.0) - 20.0).abs() < 1e-9);
        assert!((level_db(of_level_pa(57.3)) - 57.3).abs() < 1e-9);
    }
}
