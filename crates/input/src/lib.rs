//! Reading what people write: TOML and tables whose faults are located by file, line and column,
//! and quantities that cannot hold a wrong value.

mod fault;
mod file_name;
pub mod quantity;
mod toml_file;

pub use fault::Fault;
pub use file_name::file_name;
pub use quantity::{Finite, Fraction, NonNegative, Positive};
pub use toml_file::{TomlSource, toml_file, toml_text};
