//! Errors of the library as exceptions of `fieldgap.errors`, with the same message.

use fieldgap_comparison::Incomparable;
use fieldgap_input::{Fault, visible};
use miette::Diagnostic;
use pyo3::prelude::*;

pyo3::import_exception!(fieldgap.errors, FieldgapError);
pyo3::import_exception!(fieldgap.errors, ArgumentError);
pyo3::import_exception!(fieldgap.errors, FileError);
pyo3::import_exception!(fieldgap.errors, IncomparableError);

/// An argument that a function does not take.
pub fn argument_error(message: impl AsRef<str>) -> PyErr {
    ArgumentError::new_err(visible(message.as_ref()).into_owned())
}

/// A fault of a file: the message, and below it what to do.
pub fn file_error(fault: &Fault) -> PyErr {
    let remedy = fault.help().map(|help| help.to_string());
    let (line, column) = fault.line_column().unzip();
    let path = fault.path().to_owned();
    FileError::new_err((fault.to_string(), path, line, column, fault.problem().to_owned(), remedy))
}

/// Scans that cannot be compared or diagnosed.
pub fn incomparable(error: &Incomparable) -> PyErr {
    IncomparableError::new_err(visible(&error.to_string()).into_owned())
}

/// Any other error.
pub fn other_error(error: &dyn std::error::Error) -> PyErr {
    FieldgapError::new_err(visible(&error.to_string()).into_owned())
}
