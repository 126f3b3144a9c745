//! Import of measured points from files of other programs.

mod array_rows;
mod points;
mod request;
mod rows;
mod summary;
mod text_rows;
mod units;

use std::path::Path;

use fieldgap_input::{Fault, MOST_TABLE, read_bytes};

pub use points::Points;
pub use request::{
    Columns, Negative, Order, PointsRequest, Source, Units, WrongColumns, WrongUnits,
};

use crate::arrays::{ArrayFile, Opened};
use crate::text::{TextTable, unreadable};

/// Reads the points of a file.
///
/// # Errors
/// A [`Fault`] that names the line or the point of a value that is wrong; or the columns or arrays of the file, if the request does not
/// fit them.
pub fn read_points(path: &Path, request: &PointsRequest) -> Result<Points, Fault> {
    let bytes = read_bytes(path, MOST_TABLE).map_err(|error| unreadable(path, &error))?;
    points_of_bytes(path, bytes, request)
}

/// Takes `bytes` as the contents of `path`, as [`read_points`].
///
/// # Errors
/// As [`read_points`].
pub fn points_of_bytes(
    path: &Path,
    bytes: Vec<u8>,
    request: &PointsRequest,
) -> Result<Points, Fault> {
    let (rows, format, units) = match ArrayFile::of_bytes(path, bytes)? {
        Opened::Arrays(file) => array_rows::rows_of_arrays(&file, request)?,
        Opened::Text(text) => text_rows::rows_of_text(TextTable::of_bytes(path, text)?, request)?,
    };
    points::points(rows, format, &units, request)
}
