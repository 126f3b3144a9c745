//! Pictures that are kept from one page of a campaign to the next.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::super::error::ReportError;
use fieldgap_records::write_whole;

/// What was drawn: the names of files, each with a number that changes with what it shows.
pub(super) struct Kept {
    path: PathBuf,
    digests: BTreeMap<String, u64>,
    changed: bool,
}

impl Kept {
    /// As a file says; nothing if it is absent or damaged: everything is then drawn again.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read(path).unwrap_or_default();
        let digests = serde_json::from_slice(&text).unwrap_or_default();
        Self { path: path.to_owned(), digests, changed: false }
    }

    /// Whether a file was drawn with this number.
    pub fn has(&self, name: &str, digest: u64) -> bool {
        self.digests.get(name) == Some(&digest)
    }

    /// Notes that a file was drawn.
    pub fn add(&mut self, name: &str, digest: u64) {
        self.changed |= self.digests.insert(name.to_owned(), digest) != Some(digest);
    }

    /// Writes what was noted.
    pub fn write(&self) -> Result<(), ReportError> {
        if !self.changed {
            return Ok(());
        }
        put(&self.path, &serde_json::to_vec(&self.digests)?)
    }
}

/// Writes a file as a whole.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    write_whole(path, |file| file.write_all(bytes)).map_err(ReportError::write(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_drawn_is_known_the_next_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("drawn.json");
        let mut kept = Kept::read(&path);
        kept.add("a.svg", u64::MAX);
        kept.write().expect("written");
        let again = Kept::read(&path);
        assert!(
            again.has("a.svg", u64::MAX) && !again.has("a.svg", 1) && !again.has("b.svg", u64::MAX)
        );
        std::fs::write(&path, "{ damaged").expect("written");
        assert!(!Kept::read(&path).has("a.svg", u64::MAX));
    }
}
