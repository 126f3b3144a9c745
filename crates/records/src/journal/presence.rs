//! Whether the files of a running scan are still where they were opened.
//!
//! A file that was deleted or moved takes further lines without an error, but nobody will find them.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A file: its path, and what the system knows it by.
#[derive(Debug)]
pub(super) struct Presence {
    path: PathBuf,
    device: u64,
    inode: u64,
}

impl Presence {
    /// Of the file at a path.
    pub fn of(path: &Path) -> io::Result<Self> {
        let about = fs::metadata(path)?;
        Ok(Self { path: path.to_owned(), device: about.dev(), inode: about.ino() })
    }

    /// Whether that file is at its path.
    pub fn is_there(&self) -> bool {
        fs::metadata(&self.path)
            .is_ok_and(|about| (about.dev(), about.ino()) == (self.device, self.inode))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}
