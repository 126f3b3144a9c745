//! Errors of a reanalysis as a whole; what is wrong with one record is part of the results.

use std::io;
use std::path::PathBuf;

/// Why records were not analysed again.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ReanalysisError {
    /// The folder has no record.
    #[error("there is no record in {} or below it", .0.display())]
    #[diagnostic(help(
        "a record is a folder with scan.toml and samples.csv; name one, or a folder above it"
    ))]
    NoRecords(PathBuf),
    /// A folder or file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(help("check the permissions of the folder"))]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A result cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    #[diagnostic(help(
        "check that the disk has room and that the record's folder may be written; the same command continues"
    ))]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The batch is not one of a reanalysis.
    #[error("the batch is not one of a reanalysis by this version: {0}")]
    #[diagnostic(help("remove the folder of the batch, and run the command again"))]
    NotUnderstood(String),
}
