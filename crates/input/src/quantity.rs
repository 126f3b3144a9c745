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

impl OutOfRange {
    /// What was expected.
    pub fn wanted(&self) -> &'static str {
        self.wanted
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $wanted:literal, |$v:ident| $accepted:expr) => {
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
                let wanted = match value {
                    _ if value.is_finite() && value.abs() > LARGEST => "a number of at most 1e12 in magnitude",
                    _ if value > 0.0 && value < SMALLEST => "a number of 1e-12 or more",
                    _ => $wanted,
                };
                Err(OutOfRange { value, wanted })
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

/// The largest magnitude of any number in a file. No quantity of a laboratory exceeds it in the units used here, and its
/// square and cube are far from the limits of a floating-point number.
const LARGEST: f64 = 1e12;

/// The smallest of the numbers that must be above zero, for the same reason.
const SMALLEST: f64 = 1e-12;

quantity!(
    /// Any number, up to 1e12 in magnitude.
    Finite, "a finite number", |_v| true
);
impl Default for Finite {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A number above zero, from 1e-12 to 1e12.
    Positive, "a number above zero", |v| v >= SMALLEST
);
quantity!(
    /// A number of zero or above, up to 1e12.
    NonNegative, "zero or a number above zero", |v| v >= 0.0
);
quantity!(
    /// A number from 0 to 1, both included.
    Fraction, "a number from 0 to 1", |v| (0.0..=1.0).contains(&v)
);
quantity!(
    /// A coordinate in millimetres: within 100 m.
    Coordinate, "a coordinate within 100 m (in mm, not in \u{b5}m)", |v| v.abs() <= 1e5
);
impl Default for Coordinate {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A frequency of ultrasound or audible sound in hertz: 1 kHz to 10 MHz.
    Frequency, "a frequency from 1 kHz to 10 MHz (in Hz, not in kHz)", |v| (1e3..=1e7).contains(&v)
);
quantity!(
    /// A speed of sound in metres per second: from 100 m/s, below that of any gas used here, to 2000 m/s.
    SoundSpeed, "a speed of sound from 100 to 2000 m/s (not in mm/s)", |v| (100.0..=2e3).contains(&v)
);

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
        assert!(Coordinate::new(-1e5).is_ok() && Coordinate::new(1.1e5).is_err());
        assert!(Frequency::new(40e3).is_ok() && Frequency::new(40.0).is_err());
        assert!(SoundSpeed::new(343.0).is_ok() && SoundSpeed::new(343e3).is_err());
    }

    #[test]
    fn a_refusal_names_value_and_range() {
        let refusal = Positive::new(-2.0).expect_err("negative");
        assert_eq!(refusal.to_string(), "-2 is not a number above zero");
        let refusal = Positive::new(1e13).expect_err("too large");
        assert_eq!(refusal.to_string(), "1e13 is not a number of at most 1e12 in magnitude");
    }
}
