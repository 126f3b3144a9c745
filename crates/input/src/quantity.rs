//! Numbers with a range that is checked when they are read.
//!
//! Each deserialises from a TOML or JSON number and refuses numbers outside its range with the reason. The unit is in the name of the
//! field (`step_mm: Positive`).

use serde::{Deserialize, Serialize};

/// Why a number was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{value} is not {wanted}")]
pub struct OutOfRange {
    value: f64,
    wanted: &'static str,
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
                if value.is_finite() && $accepted {
                    Ok(Self(value))
                } else {
                    Err(OutOfRange { value, wanted: $wanted })
                }
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

quantity!(
    /// Any finite number.
    Finite, "a finite number", |_v| true
);
impl Default for Finite {
    /// Zero.
    fn default() -> Self {
        Self(0.0)
    }
}

quantity!(
    /// A finite number above zero.
    Positive, "a number above zero", |v| v > 0.0
);
quantity!(
    /// A finite number, zero or above.
    NonNegative, "zero or a number above zero", |v| v >= 0.0
);
quantity!(
    /// A number from 0 to 1, both included.
    Fraction, "a number from 0 to 1", |v| (0.0..=1.0).contains(&v)
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
        assert!(Positive::new(f64::INFINITY).is_err());
    }

    #[test]
    fn a_refusal_names_value_and_range() {
        let refusal = Positive::new(-2.0).expect_err("negative");
        assert_eq!(refusal.to_string(), "-2 is not a number above zero");
    }
}
