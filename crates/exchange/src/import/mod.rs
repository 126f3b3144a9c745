//! Import of measured points from files of other programs.

mod points;
mod request;
mod rows;
mod summary;
mod text_rows;
mod units;

use std::path::Path;

use fieldgap_input::Fault;

pub use points::Points;
pub use request::{
    Columns, Negative, Order, PointsRequest, Source, Units, WrongColumns, WrongUnits,
};

use crate::text::TextTable;

/// Reads the points of a file.
///
/// # Errors
/// A [`Fault`] that names the line of a value that is wrong; or the columns of the file, if the request does not fit them.
pub fn read_points(path: &Path, request: &PointsRequest) -> Result<Points, Fault> {
    let (rows, format, units) = text_rows::rows_of_text(TextTable::read(path)?, request)?;
    points::points(rows, format, &units, request)
}
