//! TOML files, parsed into types, with faults at their line.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::Fault;
use super::every_key::every_key;
use super::regular_file::{MOST_TEXT, read_text};

/// The text of a TOML file, kept so that an error found after parsing (two keys that contradict each other, a point outside travel) can
/// show its line.
#[derive(Debug, Clone)]
pub struct TomlSource {
    path: PathBuf,
    text: String,
}

impl TomlSource {
    /// Reads a file.
    ///
    /// # Errors
    /// A [`Fault`] if the file cannot be read, is not a regular file, has more than 8 MiB or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        let text = read_text(path, MOST_TEXT).map_err(|error| {
            Fault::of_file(
                path,
                format!("cannot be read: {error}"),
                "check the path; it is relative to the folder in which the command was started",
            )
        })?;
        Ok(Self::new(path, text))
    }

    /// Takes `text` as the contents of `path`.
    pub fn new(path: &Path, text: impl Into<String>) -> Self {
        Self { path: path.to_owned(), text: text.into() }
    }

    /// Where the text came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Parses the text.
    ///
    /// # Errors
    /// A [`Fault`] at the line of the first key or value that does not fit `T`. It names all keys that are missing or unknown, with an
    /// example of each that is missing.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Fault> {
        toml::from_str(&self.text).map_err(|error| {
            let range = error.span().unwrap_or(0..0);
            every_key::<T>(self).unwrap_or_else(|| {
                self.fault(
                    range,
                    error.message().trim(),
                    "correct this value or key; docs/plans.md lists those of a plan, rigs/thesis.toml those of a rig",
                )
            })
        })
    }

    /// A fault at a byte range of the text (as `toml::Spanned` gives it).
    pub fn fault(
        &self,
        range: Range<usize>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        Fault::at(&self.path, &self.text, range, problem, remedy)
    }
}

/// Reads and parses a TOML file.
///
/// # Errors
/// A [`Fault`] that names the file, and the line where there is one.
pub fn toml_file<T: DeserializeOwned>(path: &Path) -> Result<T, Fault> {
    TomlSource::read(path)?.parse()
}

/// Parses `text` as if it were the contents of `path`.
///
/// # Errors
/// As [`toml_file`].
pub fn toml_text<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, Fault> {
    TomlSource::new(path, text).parse()
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;
    use crate::Positive;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Plane {
        #[allow(dead_code)]
        step_mm: Positive,
    }

    #[test]
    fn a_value_out_of_range_is_shown_at_its_line() {
        let fault = toml_text::<Plane>(Path::new("p.toml"), "# a plane\nstep_mm = -2.0\n")
            .expect_err("the step is negative");
        assert_eq!(fault.line_column(), Some((2, 11)));
        assert_eq!(fault.to_string(), "p.toml:2:11: -2 is not a number above zero");
    }

    #[test]
    fn an_unknown_key_is_shown_at_its_line() {
        let fault = toml_text::<Plane>(Path::new("p.toml"), "step_mm = 2.0\nstepp = 1\n")
            .expect_err("the key is unknown");
        assert_eq!(fault.line_column(), Some((2, 1)));
        assert!(fault.problem().contains("stepp"), "{fault}");
    }
}
