//! The numbered settings, `$0` to `$132`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::settings::{Dialect, GrblSettings};

/// Settings that are printed without decimals.
const WHOLE: [u32; 20] = [0, 1, 2, 3, 4, 5, 6, 9, 10, 13, 20, 21, 22, 23, 26, 30, 31, 32, 37, 39];

/// The settings in the firmware's memory, which survive resets.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stored {
    values: BTreeMap<u32, f64>,
}

impl Stored {
    /// The initial settings of the rig.
    pub fn new(settings: &GrblSettings, dialect: Dialect) -> Self {
        let flag = |on: bool| f64::from(u8::from(on));
        let mut values = BTreeMap::from([
            (0, 10.0),
            (1, f64::from(settings.idle_ms)),
            (2, 0.0),
            (3, 0.0),
            (4, 0.0),
            (5, 0.0),
            (6, 0.0),
            (10, f64::from(settings.report_mask)),
            (11, 0.01),
            (12, 0.002),
            (13, flag(settings.report_inches)),
            (20, flag(settings.soft_limits)),
            (21, flag(settings.hard_limits)),
            (22, flag(settings.homing)),
            // All axes home to their low ends.
            (23, 7.0),
            (24, 15.0 * settings.homing_feed_mm_s.get()),
            (25, 60.0 * settings.homing_feed_mm_s.get()),
            (26, 25.0),
            (27, settings.pull_off_mm.get()),
            (30, 1000.0),
            (31, 0.0),
            (32, 0.0),
        ]);
        for axis in 0..3 {
            let number = axis as u32;
            values.insert(100 + number, settings.steps_per_mm.get());
            values.insert(110 + number, 60.0 * settings.max_feed_mm_s[axis].get());
            values.insert(120 + number, settings.acceleration_mm_s2.get());
            values.insert(130 + number, settings.travel_mm[axis].get());
        }
        if dialect == Dialect::GrblHal {
            values.extend([(9, 1.0), (37, 0.0), (39, 1.0)]);
            let origin = if settings.origin_at_switches { 8.0 } else { 0.0 };
            values.insert(22, flag(settings.homing) + origin);
        }
        Self { values }
    }

    /// A setting, 0 where there is none.
    pub fn value(&self, number: u32) -> f64 {
        self.values.get(&number).copied().unwrap_or(0.0)
    }

    /// The lowest bit of a setting.
    pub fn flag(&self, number: u32) -> bool {
        self.value(number) as u32 & 1 != 0
    }

    /// The answer to `$$`.
    pub fn dump(&self) -> String {
        self.values.iter().fold(String::new(), |mut text, (number, value)| {
            let digits = if WHOLE.contains(number) { 0 } else { 3 };
            let _ = write!(text, "${number}={value:.digits$}\r\n");
            text
        })
    }

    /// Stores `text` (`22=1`).
    ///
    /// # Errors
    /// The code of the error.
    pub fn store(&mut self, text: &str) -> Result<(), u32> {
        let (number, value) = text.split_once('=').ok_or(3_u32)?;
        let number: u32 = number.parse().map_err(|_| 3_u32)?;
        let value: f64 = value.parse().map_err(|_| 2_u32)?;
        if !self.values.contains_key(&number) {
            return Err(3);
        }
        if value < 0.0 {
            return Err(4);
        }
        if number == 20 && value as u32 & 1 != 0 && !self.flag(22) {
            return Err(10);
        }
        self.values.insert(number, value);
        if number == 22 && !self.flag(22) {
            self.values.insert(20, 0.0);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_printed_and_stored_as_by_the_real_firmware() {
        let mut stored = Stored::new(&GrblSettings::default(), Dialect::Grbl);
        let dump = stored.dump();
        assert!(dump.starts_with("$0=10\r\n$1=25\r\n$2=0\r\n"), "{dump}");
        assert!(dump.contains("$11=0.010\r\n") && dump.ends_with("$132=250.000\r\n"), "{dump}");
        assert_eq!(stored.store("1=255"), Ok(()));
        assert_eq!(stored.value(1), 255.0);
        assert_eq!(stored.store("99=1"), Err(3));
        assert_eq!(stored.store("1=x"), Err(2));
        assert_eq!(stored.store("1=-1"), Err(4));
        assert_eq!(stored.store("22=0"), Ok(()));
        assert!(!stored.flag(20), "no soft limits without homing");
        assert_eq!(stored.store("20=1"), Err(10));
    }
}
