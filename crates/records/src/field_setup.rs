//! What a simulation needs of a rig file.

use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;

use super::array_section::ArraySection;
use super::array_table::ArrayTable;
use super::medium_section::{MediumSection, MediumTable};
use fieldgap_input::{Fault, TomlSource};

/// A rig file; only the tables that a simulation needs are read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct FieldFile {
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
    name: Option<IgnoredAny>,
    motion: Option<IgnoredAny>,
    receiver: Option<IgnoredAny>,
    focus_array: Option<IgnoredAny>,
    environment: Option<IgnoredAny>,
    sensing: Option<IgnoredAny>,
    exposure: Option<IgnoredAny>,
    hooks: Option<IgnoredAny>,
    r#virtual: Option<IgnoredAny>,
}

/// Array and medium of a file: a rig file, or one with `[array]` and `[medium]` alone.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldSetup {
    /// The array.
    pub array: ArraySection,
    /// The medium.
    pub medium: MediumSection,
}

impl FieldSetup {
    /// Reads `[array]` and `[medium]`. The tables of the devices may be missing or incomplete.
    ///
    /// # Errors
    /// A [`Fault`] at the line that is wrong, or at a table that no rig file has.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        let source = TomlSource::read(path)?;
        let FieldFile { array, medium, .. } = source.parse()?;
        Ok(Self {
            array: ArraySection::read(&array, &source)?,
            medium: MediumSection::read(&medium, &source)?,
        })
    }
}
