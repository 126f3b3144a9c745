//! The audit log: a line for every act, with who, when, what and from where.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::net::IpAddr;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use jiff::Timestamp;
use serde::Serialize;

/// One act.
#[derive(Debug, Clone, Serialize)]
pub struct Act<'a> {
    /// When it was answered.
    pub at: Timestamp,
    /// Name of the person or program; empty where nobody was logged in.
    pub who: &'a str,
    /// Number of the session or token; 0 where there was none.
    pub session: u64,
    /// The address that it came from.
    pub from: IpAddr,
    /// Method and path.
    pub act: &'a str,
    /// Status of the answer.
    pub status: u16,
}

/// The log, a file of lines of JSON that is only ever appended to.
#[derive(Debug)]
pub struct Audit(Mutex<File>);

impl Audit {
    /// Opens the log, or begins it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn open(path: &Path) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        OpenOptions::new().create(true).append(true).open(path).map(|file| Self(Mutex::new(file)))
    }

    /// Adds a line. A disk that is full must not hold up a stop, so a failure is logged and not returned.
    pub fn add(&self, act: &Act<'_>) {
        let Ok(mut line) = serde_json::to_vec(act) else { return };
        line.push(b'\n');
        let mut file = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = file.write_all(&line) {
            tracing::error!("the audit log cannot be written: {error}");
        }
    }
}
