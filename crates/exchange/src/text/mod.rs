//! Tables of numbers in text, with any separator, decimal mark and heading.

mod dialect;
mod number;
mod table;

pub use dialect::{Decimal, Delimiter, Dialect};
pub(crate) use table::{Heading, TextTable, unreadable};
