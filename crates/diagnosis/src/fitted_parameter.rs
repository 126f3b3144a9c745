//! A fitted parameter as a diagnosis gives it.

use serde::Serialize;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum FittedParameter {
    /// A number and its standard error.
    Real {
        /// The value.
        value: f64,
        /// Its standard error, NaN where the data do not tell it.
        standard_error: f64,
    },
    /// A complex number, `[real, imaginary]`, and the standard error of each part.
    Complex {
        /// Real and imaginary part.
        value: [f64; 2],
        /// Their standard errors.
        standard_error: [f64; 2],
    },
    /// A word, such as the name of an axis.
    Word {
        /// The word.
        value: &'static str,
    },
    /// A list of elements.
    Elements {
        /// Their numbers from 0.
        value: Vec<usize>,
    },
    /// A number for each element of the array, in its order, each with its standard error; of `zeros`, for each drive.
    Each {
        /// The values.
        value: Vec<f64>,
        /// Their standard errors.
        standard_error: Vec<f64>,
    },
}
