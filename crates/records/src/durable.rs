//! Files that are completely on disk when a call returns.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// Replaces a file so that it always has either the old or the new contents, also after a power failure.
///
/// The new contents are written to a file beside it and synced; that file is then renamed, and the folder synced.
///
/// # Errors
/// What the file system reports; the old file then still exists.
pub fn replace(path: &Path, contents: &[u8]) -> io::Result<()> {
    write_whole(path, |file| file.write_all(contents))
}

/// Replaces a file, or creates it, with what `write` writes, so that it always has either the old or the new contents, also after a power
/// failure.
///
/// # Errors
/// What `write` or the file system reports; the old file then still exists.
pub fn write_whole(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let written = File::create(&beside).and_then(|mut file| {
        write(&mut file)?;
        file.sync_all()
    });
    if let Err(error) = written.and_then(|()| fs::rename(&beside, path)) {
        // Best effort: the first error is the one to report, and a leftover is overwritten next time.
        let _ = fs::remove_file(&beside);
        return Err(error);
    }
    sync_folder(path.parent().unwrap_or(Path::new("")))
}

/// Makes the names in a folder durable.
///
/// # Errors
/// What the file system reports.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    // Only Unix opens folders as files; elsewhere nothing more can be done than the rename.
    if cfg!(unix) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

/// Where lines are appended: a file, or in tests a disk that fails on purpose.
pub trait Disk: Write + Send {
    /// Waits until everything written is on disk.
    fn sync(&mut self) -> io::Result<()>;
    /// Truncates to `length` bytes.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

impl Disk for File {
    fn sync(&mut self) -> io::Result<()> {
        self.sync_data()
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

/// A file that grows by complete lines, each on disk before [`Lines::append`] returns.
#[derive(Debug)]
pub struct Lines<D> {
    disk: D,
    /// Bytes of complete, synced lines.
    length: u64,
    /// Whether there may be bytes after them that were not acknowledged.
    torn: bool,
}

impl<D: Disk> Lines<D> {
    /// Appends to a disk with `length` bytes of complete lines and nothing after them.
    pub fn after(disk: D, length: u64) -> Self {
        Self { disk, length, torn: false }
    }

    /// Appends a line, including its line end, and waits until it is on disk.
    ///
    /// # Errors
    /// What the disk reports. The line then counts as not written: a part of it is cut off now or, if the disk refuses that too, before
    /// the next line.
    pub fn append(&mut self, line: &str) -> io::Result<()> {
        self.write(line)?;
        self.disk.sync().inspect_err(|_| self.forget(line))
    }

    /// Appends a line, including its line end. It is on disk only after [`Lines::sync`].
    ///
    /// # Errors
    /// As [`Lines::append`].
    pub fn write(&mut self, line: &str) -> io::Result<()> {
        if self.torn {
            self.cut_torn_end()?;
        }
        if let Err(error) = self.disk.write_all(line.as_bytes()) {
            self.torn = true;
            // The first error is the one to report; cutting is tried again before the next line.
            let _ = self.cut_torn_end();
            return Err(error);
        }
        self.length += line.len() as u64;
        Ok(())
    }

    /// Removes the last line, which was not acknowledged: it is cut off now or before the next line.
    pub fn forget(&mut self, line: &str) {
        self.length -= line.len() as u64;
        self.torn = true;
        let _ = self.cut_torn_end();
    }

    /// Waits until all lines are on disk.
    ///
    /// # Errors
    /// What the disk reports.
    pub fn sync(&mut self) -> io::Result<()> {
        self.disk.sync()
    }

    /// Cuts off what is after the lines and was not acknowledged.
    ///
    /// # Errors
    /// What the disk reports.
    pub fn cut_torn_end(&mut self) -> io::Result<()> {
        self.disk.cut(self.length)?;
        self.disk.sync()?;
        self.torn = false;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A disk with room for so many bytes.
    struct SmallDisk {
        bytes: Vec<u8>,
        room: usize,
    }

    impl Write for SmallDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let fits = bytes.len().min(self.room - self.bytes.len());
            if fits == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.bytes.extend(&bytes[..fits]);
            Ok(fits)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Disk for SmallDisk {
        fn sync(&mut self) -> io::Result<()> {
            Ok(())
        }

        fn cut(&mut self, length: u64) -> io::Result<()> {
            self.bytes.truncate(usize::try_from(length).expect("a small disk"));
            Ok(())
        }
    }

    proptest! {
        #[test]
        fn a_full_disk_has_the_acknowledged_lines_and_nothing_else(
            lines in prop::collection::vec("[a-z]{0,9}\n", 1..12),
            room in 0usize..60,
        ) {
            let mut file = Lines::after(SmallDisk { bytes: Vec::new(), room }, 0);
            let mut acknowledged = String::new();
            for line in &lines {
                if file.append(line).is_ok() {
                    acknowledged += line;
                }
            }
            prop_assert_eq!(String::from_utf8(file.disk.bytes).expect("text"), acknowledged);
        }
    }

    #[test]
    fn a_file_is_replaced_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state.toml");
        replace(&path, b"old").expect("written");
        replace(&path, b"new").expect("written");
        assert_eq!(fs::read(&path).expect("there"), b"new");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }

    #[test]
    fn a_file_that_cannot_be_replaced_is_not_changed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a folder in the way");
        fs::create_dir(&path).expect("made");
        fs::write(path.join("kept"), "").expect("written");
        assert!(replace(&path, b"new").is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }
}
