//! The largest reading that a receiver can give, by the unit of a record.

/// Largest voltage, V. Receivers give less than 1 kV; simulated records in arbitrary volts have some more. Set by judgement.
const MOST_V: f64 = 1e6;

/// Largest sound pressure, Pa: ten times the amplitude at which the trough of a wave in air is a vacuum (101 325 Pa), so that linear
/// simulations of strong sources can be recorded. Set by judgement.
const MOST_PA: f64 = 1e6;

/// Largest number of counts. Converters have at most 32 bits.
const MOST_COUNTS: f64 = 4_294_967_296.0;

/// Prefixes of volts and pascals, and their factors.
const PREFIXES: [(&str, f64); 8] = [
    ("", 1.0),
    ("n", 1e-9),
    ("u", 1e-6),
    ("\u{b5}", 1e-6),
    ("\u{3bc}", 1e-6),
    ("m", 1e-3),
    ("h", 1e2),
    ("k", 1e3),
];

/// The readings that are possible in a unit: from zero to the largest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReadingRange {
    most: f64,
    /// What is expected of a reading, for messages.
    wanted: String,
}

impl ReadingRange {
    /// Of a unit. In a unit that is not known here every number of a table is possible.
    pub(super) fn of(unit: &str) -> Self {
        let unit = unit.trim();
        let up_to = |most: f64, quantity: &str| Self {
            most,
            wanted: format!("zero or {quantity} of at most {most} {unit}"),
        };
        let prefixed = |base: &str| {
            let prefix = unit.strip_suffix(base)?;
            PREFIXES.iter().find(|(name, _)| *name == prefix).map(|(_, factor)| *factor)
        };
        let counts = ["count", "counts", "LSB", "lsb", "adc", "ADC", "digit", "digits"];
        if let Some(factor) = prefixed("V") {
            return up_to(MOST_V / factor, "a voltage");
        }
        if let Some(factor) = prefixed("Pa") {
            return up_to(MOST_PA / factor, "a sound pressure in air");
        }
        match counts.contains(&unit) {
            true => up_to(MOST_COUNTS, "a number of a 32-bit converter"),
            false => Self { most: f64::MAX, wanted: "zero or a number above zero".to_owned() },
        }
    }

    /// Whether a reading is possible.
    pub(super) fn contains(&self, reading: f64) -> bool {
        (0.0..=self.most).contains(&reading)
    }

    /// What is expected of a reading, for messages.
    pub(super) fn wanted(&self) -> &str {
        &self.wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_unit_has_the_range_of_its_receiver() {
        for (unit, possible, impossible) in [
            ("V", 1200.0, 1e160),
            ("mV", 5e5, 2e9),
            ("\u{b5}V", 5e8, 2e12),
            ("Pa", 4e3, 2e6),
            ("kPa", 4.0, 2e3),
            ("count", 4095.0, 5e9),
        ] {
            let range = ReadingRange::of(unit);
            assert!(range.contains(0.0) && range.contains(possible), "{unit}");
            for reading in [impossible, -1.0, f64::NAN, f64::INFINITY] {
                assert!(!range.contains(reading), "{unit} {reading}");
            }
        }
    }

    #[test]
    fn another_unit_has_no_limit_of_its_own() {
        for unit in ["1", "arb. units", "GV", "mW", ""] {
            assert!(ReadingRange::of(unit).contains(1e11), "{unit}");
        }
    }

    #[test]
    fn the_limit_is_stated_in_the_unit_of_the_record() {
        let range = ReadingRange::of("mV");
        assert_eq!(range.wanted(), "zero or a voltage of at most 1000000000 mV");
    }
}
