//! A file of rounds: one line of JSON each, in order.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use fieldgap_input::{MOST_TABLE, read_text};
use fieldgap_records::write_whole;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// One line of such a file.
pub trait LoggedRound: Serialize + DeserializeOwned {
    /// The file, in the folder of the record.
    const FILE: &'static str;

    /// Its number, from 0.
    fn number(&self) -> usize;

    /// Readings that were taken before it.
    fn before(&self) -> usize;

    /// The same decision for no readings.
    fn forget_readings(&mut self);
}

/// A log of rounds that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RoundsError {
    /// The file cannot be read or written.
    #[error("{path}: {source}", path = .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A line is no round.
    #[error("{path}, line {line}: {reason}", path = .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
}

/// Reads the rounds of the record in `folder`; none without the file.
///
/// # Errors
/// [`RoundsError`] if the file cannot be read or a line of it is no round.
pub fn read_log<R: LoggedRound>(folder: &Path) -> Result<Vec<R>, RoundsError> {
    let path = folder.join(R::FILE);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = read_text(&path, MOST_TABLE)
        .map_err(|source| RoundsError::File { path: path.clone(), source })?;
    parse_log(&path, &text)
}

/// Reads the text of such a file.
///
/// # Errors
/// [`RoundsError::Line`] at the first line that is no round, or that is out of order.
pub fn parse_log<R: LoggedRound>(path: &Path, text: &str) -> Result<Vec<R>, RoundsError> {
    let mut rounds = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let wrong =
            |reason: String| RoundsError::Line { path: path.to_owned(), line: index + 1, reason };
        let round: R = serde_json::from_str(line).map_err(|error| wrong(error.to_string()))?;
        if round.number() != index {
            return Err(wrong(format!("round {} stands where {index} is due", round.number())));
        }
        rounds.push(round);
    }
    Ok(rounds)
}

/// Writes the rounds of the record in `folder`. They are on disk when this returns.
///
/// # Errors
/// [`RoundsError::File`].
pub fn write_log<R: LoggedRound>(folder: &Path, rounds: &[R]) -> Result<(), RoundsError> {
    let path = folder.join(R::FILE);
    let file = |source| RoundsError::File { path: path.clone(), source };
    let lines: Result<Vec<String>, serde_json::Error> =
        rounds.iter().map(serde_json::to_string).collect();
    let text = lines.map_err(|error| file(error.into()))?.join("\n") + "\n";
    fs::create_dir_all(folder).map_err(file)?;
    write_whole(&path, |to| io::Write::write_all(to, text.as_bytes())).map_err(file)
}
