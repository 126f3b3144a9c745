//! Files that are on disk, whole, once a call has returned.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// Writes a file so that whoever looks, also after a power cut, finds the old contents or the new, never a part.
///
/// Writes beside it, syncs, renames over it, syncs the folder.
///
/// # Errors
/// What the file system reports; the old file is then still there.
pub fn replace(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let written = File::create(&beside).and_then(|mut file| {
        file.write_all(contents)?;
        file.sync_all()
    });
    if let Err(error) = written.and_then(|()| fs::rename(&beside, path)) {
        // Best effort: what went wrong first is what matters, and a leftover is overwritten next time.
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
    // Only Unix opens folders as files; elsewhere the rename itself is as durable as it gets.
    if cfg!(unix) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

/// Where lines are appended: a file, or in tests a disk that fails when it is told to.
pub trait Disk: Write + Send {
    /// Waits until all that was written is on disk.
    fn sync(&mut self) -> io::Result<()>;
    /// Cuts off all beyond `length` bytes.
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

/// A file that grows by whole lines, each on disk before [`Lines::append`] returns.
#[derive(Debug)]
pub struct Lines<D> {
    disk: D,
    /// Bytes of whole, synced lines.
    length: u64,
    /// Whether something that was not acknowledged may stand after them.
    torn: bool,
}

impl<D: Disk> Lines<D> {
    /// Appends to a disk that holds `length` bytes of whole lines and nothing after them.
    pub fn after(disk: D, length: u64) -> Self {
        Self { disk, length, torn: false }
    }

    /// Appends a line, its line end included, and waits until it is on disk.
    ///
    /// # Errors
    /// What the disk reports. The line then counts as never written: what may stand of it is cut off, now or, if
    /// the disk refuses that too, before the next line.
    pub fn append(&mut self, line: &str) -> io::Result<()> {
        self.write(line)?;
        self.disk.sync().inspect_err(|_| self.forget(line))
    }

    /// Appends a line, its line end included; it may not be on disk before [`Lines::sync`].
    ///
    /// # Errors
    /// As [`Lines::append`].
    pub fn write(&mut self, line: &str) -> io::Result<()> {
        if self.torn {
            self.mend()?;
        }
        if let Err(error) = self.disk.write_all(line.as_bytes()) {
            self.torn = true;
            // The first error is the one to report; mending is tried again before the next line.
            let _ = self.mend();
            return Err(error);
        }
        self.length += line.len() as u64;
        Ok(())
    }

    /// Takes the last line back, which was not acknowledged to anybody: it is cut off, now or before the next line.
    pub fn forget(&mut self, line: &str) {
        self.length -= line.len() as u64;
        self.torn = true;
        let _ = self.mend();
    }

    /// Waits until all lines are on disk.
    ///
    /// # Errors
    /// What the disk reports.
    pub fn sync(&mut self) -> io::Result<()> {
        self.disk.sync()
    }

    /// Cuts off what stands after the lines and was never acknowledged.
    ///
    /// # Errors
    /// What the disk reports.
    pub fn mend(&mut self) -> io::Result<()> {
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
        fn a_full_disk_holds_the_acknowledged_lines_and_nothing_else(
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
    fn what_cannot_be_replaced_is_left_as_it_was() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a folder in the way");
        fs::create_dir(&path).expect("made");
        fs::write(path.join("kept"), "").expect("written");
        assert!(replace(&path, b"new").is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }
}
