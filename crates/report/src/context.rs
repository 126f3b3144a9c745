//! The facts of a report that the comparison does not hold.

use super::picture::PrintStyle;

/// Facts that the comparison does not hold: set-up, software, input files and warnings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportContext {
    /// Heading of the page.
    pub title: String,
    /// The set-up as rows of a table: label, value with its unit.
    pub set_up: Vec<(String, String)>,
    /// Name and version of the software.
    pub software: String,
    /// Files that the report was made from.
    pub inputs: Vec<InputFile>,
    /// The other pages of the same record: title and address.
    pub pages: Vec<(String, String)>,
    /// What limits the figures, for instance that the scan is partial; one sentence each.
    pub warnings: Vec<String>,
    /// How its pictures are to be printed.
    pub pictures: PrintStyle,
}

/// A file that a report was made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Its name, without the folder.
    pub name: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}
