//! Numbers with a range that is checked when they are read.
//!
//! Each deserialises from a TOML or JSON number and refuses numbers outside its range with the reason. The unit is in the name of the
//! field (`step_mm: Positive`).

use serde::{Deserialize, Serialize};

/// Why a number was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{} is not {wanted}{}", shown(*value), question(*guess))]
pub struct OutOfRange {
    value: f64,
    wanted: &'static str,
    /// The unit in which the number would be in range, and the number in the unit that is wanted.
    guess: Option<(&'static str, f64)>,
}

/// Asks whether another unit was meant.
fn question(guess: Option<(&'static str, f64)>) -> String {
    guess.map_or(String::new(), |(unit, value)| {
        format!("; written in {unit}? Then give {}", shown((value * 1e9).round() / 1e9))
    })
}

/// A number without the zeros of a large one.
fn shown(value: f64) -> String {
    if value.is_finite() && value.abs() > LARGEST {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// Whether the range of a quantity is stated by its own words.
#[derive(Clone, Copy)]
enum Range {
    /// Every number that a file may hold, from the least to the largest magnitude.
    General,
    /// A narrower one, with its bounds in the words.
    Own,
}

/// What is wanted in place of a number.
fn wanted(value: f64, range: Range, words: &'static str) -> &'static str {
    match range {
        Range::General if value.is_finite() && value.abs() > LARGEST => {
            "a number of at most 1e12 in magnitude"
        }
        Range::General if value > 0.0 && value < SMALLEST => "a number of 1e-12 or more",
        _ => words,
    }
}

impl OutOfRange {
    /// What was expected.
    pub fn wanted(&self) -> &'static str {
        self.wanted
    }
}

/// Units that people write by mistake, and the factor from each to the unit that is wanted.
macro_rules! mistaken {
    () => {
        &[]
    };
    ($units:expr) => {
        &$units
    };
}

macro_rules! quantity {
    (
        $(#[$doc:meta])* $name:ident, $range:ident $wanted:literal, |$v:ident| $accepted:expr
        $(, mistaken $units:expr)?
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);

        impl $name {
            /// Takes `value` if it lies in range.
            ///
            /// # Errors
            /// [`OutOfRange`] if it does not, or is not finite.
            pub fn new(value: f64) -> Result<Self, OutOfRange> {
                let accepted = |$v: f64| $v.abs() <= LARGEST && $accepted;
                if accepted(value) {
                    return Ok(Self(value));
                }
                let units: &[(&'static str, f64)] = mistaken!($($units)?);
                let in_wanted = units.iter().map(|&(unit, factor)| (unit, value * factor));
                let guess = in_wanted.into_iter().find(|&(_, value)| accepted(value));
                Err(OutOfRange { value, wanted: wanted(value, Range::$range, $wanted), guess })
            }

            /// The number, in the unit of the field that holds it.
            pub fn get(self) -> f64 {
                self.0
            }
        }

        impl TryFrom<f64> for $name {
            type Error = OutOfRange;
            fn try_from(value: f64) -> Result<Self, OutOfRange> {
                Self::new(value)
            }
        }

        impl From<$name> for f64 {
            fn from(quantity: $name) -> f64 {
                quantity.0
            }
        }
    };
}

/// A quantity whose number stands in the source code.
///
/// # Panics
/// If the number is out of range.
pub fn literal<T: TryFrom<f64, Error = OutOfRange>>(number: f64) -> T {
    T::try_from(number).unwrap_or_else(|refused| panic!("{refused}"))
}

/// The largest magnitude of any number in a file. No quantity of a laboratory exceeds it in the units used here, and its
/// square and cube are far from the limits of a floating-point number.
const LARGEST: f64 = 1e12;

/// The smallest of the numbers that must be above zero, for the same reason.
const SMALLEST: f64 = 1e-12;

quantity!(
    /// Any number, up to 1e12 in magnitude.
    Finite, General "a finite number", |_v| true
);
impl Default for Finite {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A number above zero, from 1e-12 to 1e12.
    Positive, General "a number above zero", |v| v >= SMALLEST
);
quantity!(
    /// A number of zero or above, up to 1e12.
    NonNegative, General "zero or a number above zero", |v| v >= 0.0
);
quantity!(
    /// A number from 0 to 1, both included.
    Fraction, Own "a number from 0 to 1", |v| (0.0..=1.0).contains(&v)
);
quantity!(
    /// A coordinate in millimetres: within 100 m.
    Coordinate, Own "a coordinate within 100 m (in mm, not in \u{b5}m)", |v| v.abs() < 1e5
);
quantity!(
    /// A place in the field of an array, along one axis, in millimetres: within 10 m of the array. At 40 kHz air alone absorbs 13 dB on this way.
    Place, Own "a place within 10 m of the array (in mm, not in \u{b5}m)", |v| v.abs() < 1e4
);
impl Default for Place {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A length in millimetres, such as a size or a step: from a nanometre to 100 m.
    Length, Own "a length above zero, from 1e-6 mm to 100 m (in mm, not in \u{b5}m)", |v| (1e-6..1e5).contains(&v)
);
quantity!(
    /// A speed of a robot in millimetres per second, up to 10 m/s.
    Speed, Own "a speed above zero, from 1e-3 mm/s to 10 m/s (in mm/s, not in \u{b5}m/s)", |v| (1e-3..=1e4).contains(&v),
    mistaken [("\u{b5}m/s", 1e-3)]
);
quantity!(
    /// A gap or an amplitude in millimetres: zero, or up to 100 m.
    Gap, Own "zero or a length within 100 m (in mm, not in \u{b5}m)", |v| (0.0..1e5).contains(&v)
);
quantity!(
    /// A time above zero in seconds, milliseconds or minutes, from 1e-9 to 1e9; so many seconds are thirty years.
    Time, Own "a time above zero, from 1e-9 to 1e9", |v| (1e-9..=1e9).contains(&v)
);
quantity!(
    /// A time in seconds, milliseconds or minutes: zero, or up to 1e9.
    Delay, Own "zero or a time of at most 1e9", |v| (0.0..=1e9).contains(&v)
);
quantity!(
    /// A rate in hertz, of samples or of a modulation: from 1e-6 Hz to 10 GHz.
    Rate, Own "a rate above zero, from 1e-6 Hz to 10 GHz (in Hz)", |v| (1e-6..=1e10).contains(&v)
);
impl Default for Coordinate {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A frequency of ultrasound or audible sound in hertz: 1 kHz to 10 MHz.
    Frequency, Own "a frequency from 1 kHz to 10 MHz (in Hz, not in kHz)", |v| (1e3..=1e7).contains(&v),
    mistaken [("kHz", 1e3), ("MHz", 1e6)]
);
quantity!(
    /// A speed of sound in metres per second: from 100 m/s, below that of any gas used here, to 2000 m/s.
    SoundSpeed, Own "a speed of sound from 100 to 2000 m/s (not in mm/s)", |v| (100.0..=2e3).contains(&v),
    mistaken [("mm/s", 1e-3), ("cm/s", 1e-2), ("km/s", 1e3)]
);

/// A narrower range, taken as a wider one.
macro_rules! widens {
    ($($narrow:ident to $wide:ident),*) => {$(
        impl From<$narrow> for $wide {
            fn from(quantity: $narrow) -> Self {
                Self(quantity.0)
            }
        }
    )*};
}

widens!(Speed to Positive, Rate to Positive, Time to Positive, Length to Positive, Delay to NonNegative, Gap to NonNegative);

/// Reads a quantity of a narrow range into a field of a wider one: `#[serde(deserialize_with = "as_narrow::<Rate, _, _>")]`.
///
/// # Errors
/// As the narrow quantity.
pub fn as_narrow<'de, N, W, D>(deserializer: D) -> Result<W, D::Error>
where
    N: Deserialize<'de> + Into<W>,
    D: serde::Deserializer<'de>,
{
    N::deserialize(deserializer).map(Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_quantity_refuses_numbers_out_of_range() {
        assert!(Finite::new(-3.0).is_ok() && Finite::new(f64::NAN).is_err());
        assert!(Positive::new(1e-9).is_ok() && Positive::new(0.0).is_err());
        assert!(NonNegative::new(0.0).is_ok() && NonNegative::new(-1e-9).is_err());
        assert!(Fraction::new(1.0).is_ok() && Fraction::new(1.0 + 1e-9).is_err());
        assert!(Positive::new(f64::INFINITY).is_err() && Positive::new(1e13).is_err());
        assert!(Coordinate::new(-9e4).is_ok() && Coordinate::new(1e5).is_err());
        assert!(
            Place::new(-9999.0).is_ok() && Place::new(1e5).is_err() && Place::new(1e308).is_err()
        );
        assert!(
            Length::new(1e-6).is_ok() && Length::new(0.0).is_err() && Length::new(1e-9).is_err()
        );
        assert!(Gap::new(0.0).is_ok() && Gap::new(-1.0).is_err() && Gap::new(1e5).is_err());
        assert!(Speed::new(80.0).is_ok() && Speed::new(80e3).is_err());
        assert!(Time::new(1e9).is_ok() && Time::new(0.0).is_err() && Delay::new(0.0).is_ok());
        assert!(Rate::new(1e3).is_ok() && Rate::new(0.0).is_err() && Delay::new(1e10).is_err());
        assert!(Frequency::new(40e3).is_ok() && Frequency::new(40.0).is_err());
        assert!(SoundSpeed::new(343.0).is_ok() && SoundSpeed::new(343e3).is_err());
    }

    #[test]
    fn a_number_in_another_unit_is_asked_about() {
        let asked = |refused: OutOfRange, words: &str| {
            assert!(refused.to_string().ends_with(words), "{refused}");
        };
        asked(SoundSpeed::new(343e3).unwrap_err(), "; written in mm/s? Then give 343");
        asked(SoundSpeed::new(34_300.0).unwrap_err(), "; written in cm/s? Then give 343");
        asked(SoundSpeed::new(0.343).unwrap_err(), "; written in km/s? Then give 343");
        asked(Frequency::new(40.0).unwrap_err(), "; written in kHz? Then give 40000");
        asked(Frequency::new(0.04).unwrap_err(), "; written in MHz? Then give 40000");
        asked(Speed::new(50e3).unwrap_err(), "; written in \u{b5}m/s? Then give 50");
        // No unit explains a negative number.
        asked(SoundSpeed::new(-343.0).unwrap_err(), "(not in mm/s)");
    }

    #[test]
    fn a_refusal_names_value_and_range() {
        let refusal = Positive::new(-2.0).expect_err("negative");
        assert_eq!(refusal.to_string(), "-2 is not a number above zero");
        let refusal = Positive::new(1e13).expect_err("too large");
        assert_eq!(refusal.to_string(), "1e13 is not a number of at most 1e12 in magnitude");
        let refusal = Place::new(100_000.0).expect_err("in micrometres");
        assert_eq!(
            refusal.to_string(),
            "100000 is not a place within 10 m of the array (in mm, not in \u{b5}m)"
        );
    }
}
