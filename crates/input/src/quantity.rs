//! Numbers with a range that is checked when they are read.
//!
//! Each deserialises from a TOML or JSON number and refuses numbers outside its range with the reason. The unit is in the name of the
//! field (`step_mm: Positive`).

use serde::{Deserialize, Serialize};

/// Why a number was refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{} is not {wanted}", shown(*value))]
pub struct OutOfRange {
    value: f64,
    wanted: &'static str,
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

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $range:ident $wanted:literal, |$v:ident| $accepted:expr) => {
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
                let $v = value;
                if value.abs() <= LARGEST && $accepted {
                    return Ok(Self(value));
                }
                Err(OutOfRange { value, wanted: wanted(value, Range::$range, $wanted) })
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
    Speed, Own "a speed above zero, from 1e-3 mm/s to 10 m/s (in mm/s, not in \u{b5}m/s)", |v| (1e-3..=1e4).contains(&v)
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
    Frequency, Own "a frequency from 1 kHz to 10 MHz (in Hz, not in kHz)", |v| (1e3..=1e7).contains(&v)
);
quantity!(
    /// A speed of sound in metres per second: from 100 m/s, below that of any gas used here, to 2000 m/s.
    SoundSpeed, Own "a speed of sound from 100 to 2000 m/s (not in mm/s)", |v| (100.0..=2e3).contains(&v)
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
