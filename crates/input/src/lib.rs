//! Input files: TOML with errors that name file, line and column, and numbers with a checked range.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_input::{Positive, toml_text};
//! use serde::Deserialize;
//!
//! #[derive(Debug, Deserialize)]
//! struct Plane {
//!     step_mm: Positive,
//! }
//!
//! let plane: Plane = toml_text(Path::new("plane.toml"), "step_mm = 2.5")?;
//! assert_eq!(plane.step_mm.get(), 2.5);
//! let fault = toml_text::<Plane>(Path::new("plane.toml"), "# a comment\nstep_mm = -2.5").unwrap_err();
//! assert_eq!(fault.to_string(), "plane.toml:2:11: -2.5 is not a number above zero");
//! # Ok::<(), fieldgap_input::Fault>(())
//! ```
//!
//! Begin with [`toml_file`] to read a file, [`TomlSource`] to report errors that are found after reading, and [`Positive`] and its
//! relatives for the fields of your types. All errors are a [`Fault`].
//! [`read_bytes`] reads regular files of a bounded size; [`visible`] is for text from outside that is shown on a terminal.

mod dotted_key;
mod every_key;
mod exact;
mod examples;
mod excerpt;
mod fault;
mod file_name;
mod label;
mod quantity;
mod regular_file;
mod toml_file;
mod visible;

pub use dotted_key::{NotAKey, set_key};
pub use every_key::ONE_TABLE_OF;
pub use exact::Exact;
pub use fault::Fault;
pub use file_name::file_name;
pub use label::{Label, NoLabel};
pub use quantity::{
    Coordinate, Delay, Finite, Fraction, Frequency, Gap, Length, NonNegative, OutOfRange, Place,
    Positive, Rate, SoundSpeed, Speed, Time, as_narrow, literal,
};
pub use regular_file::{MOST_TABLE, MOST_TEXT, read_bytes, read_text, regular};
pub use toml_file::{TomlSource, toml_file, toml_text};
pub use visible::{is_hidden, visible, visible_json, visible_line};
