//! Numbers and arrays from Python, checked before the library sees them.

use fieldgap_acoustics::{Simulator, Vec3};
use numpy::{AllowTypeChange, PyArrayLike1, PyArrayLike2};
use pyo3::prelude::*;

use crate::error::argument_error;

/// Farthest place from the array, m; the limit of `fieldgap_input::Place`.
pub const FARTHEST_M: f64 = 10.0;

/// Longest length, m; the limit of `fieldgap_input::Length`.
const LONGEST_M: f64 = 100.0;

/// One number for each element or reading; anything that NumPy takes as an array of numbers.
pub type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// A row of three numbers for each element or reading.
pub type Triples<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;

/// A length above zero, m.
pub fn length_m(name: &str, value: f64) -> PyResult<f64> {
    if (1e-9..LONGEST_M).contains(&value) {
        return Ok(value);
    }
    Err(argument_error(format!(
        "{name} is {value}; a length from 1e-9 to 100 is needed, in metres (not in millimetres)"
    )))
}

/// A point within ten metres of the array, m.
pub fn place_m(name: &str, [x, y, z]: [f64; 3]) -> PyResult<Vec3> {
    if [x, y, z].iter().all(|along| along.abs() < FARTHEST_M) {
        return Ok(Vec3::new(x, y, z));
    }
    Err(argument_error(format!(
        "{name} is ({x}, {y}, {z}); a point within 10 m of the array is needed, in metres (not in millimetres)"
    )))
}

/// The rows of an array of shape (N, 3).
pub fn rows(name: &str, array: &Triples<'_>) -> PyResult<Vec<[f64; 3]>> {
    let view = array.as_array();
    let &[count, width] = view.shape() else {
        return Err(argument_error(format!("{name} needs the shape (N, 3)")));
    };
    if width != 3 {
        return Err(argument_error(format!(
            "{name} has the shape ({count}, {width}); it needs (N, 3): x, y and z in each row"
        )));
    }
    Ok(view.outer_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// The numbers of an array of shape (N,), `count` of them, all finite.
pub fn numbers(name: &str, array: &Numbers<'_>, count: usize) -> PyResult<Vec<f64>> {
    let numbers = array.as_array().to_vec();
    if numbers.len() != count {
        return Err(argument_error(format!(
            "{name} has {} numbers; {count} are needed",
            numbers.len()
        )));
    }
    match numbers.iter().position(|number| !number.is_finite()) {
        Some(at) => Err(argument_error(format!("{name}[{at}] is {}", numbers[at]))),
        None => Ok(numbers),
    }
}

/// A simulator by its name.
pub fn simulator(name: &str) -> PyResult<Simulator> {
    name.parse().map_err(|unknown: fieldgap_acoustics::UnknownSimulator| {
        argument_error(unknown.to_string())
    })
}
