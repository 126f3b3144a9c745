//! Files of other programs: measured points are imported as a record, and a record is exported.
//!
//! Begin with [`import::read_points`] to read points, and with [`export::dataset_of_record`] and [`export::write_dataset`] to export.

mod arrays;
mod dataset;
pub mod export;
pub mod import;
mod mat5_tags;
mod netcdf_tags;
mod text;
pub mod unit;

pub use dataset::{Attribute, Dataset, Values, Variable};
pub use text::{Decimal, Delimiter, Dialect};
