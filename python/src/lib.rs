//! The native half of the Python package `fieldgap`. What people use, and its documentation, is in `python/fieldgap`.
//!
//! Units in Python are SI: metres, pascals, radians, hertz. Long sums and fits run without the interpreter's lock.
//!
//! | file | what it holds |
//! |---|---|
//! | `argument` | numbers from Python, checked |
//! | `error` | errors of the library as Python exceptions |
//! | `threads` | the threads of a call, and calls that Ctrl-C ends |
//! | `array`, `medium`, `transducer` | what a field is computed from |
//! | `simulate`, `plane` | the field at an array of points |
//! | `record`, `compare`, `diagnose` | recorded scans and what is found in them |

mod argument;
mod array;
mod compare;
mod diagnose;
mod error;
mod medium;
mod plane;
mod record;
mod simulate;
mod threads;
mod transducer;

use pyo3::prelude::*;

/// Classes and functions for the package `fieldgap`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::array::PythonArray;
    #[pymodule_export]
    use crate::compare::{PythonComparison, compare};
    #[pymodule_export]
    use crate::diagnose::{PythonDiagnosis, diagnose};
    #[pymodule_export]
    use crate::medium::PythonMedium;
    #[pymodule_export]
    use crate::record::PythonRecord;
    #[pymodule_export]
    use crate::simulate::simulate;
    #[pymodule_export]
    use crate::transducer::PythonTransducer;
}
