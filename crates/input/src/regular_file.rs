//! Reading of files with a bound on their size, which is checked before memory is taken.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// Most bytes of a file that people write, such as a plan: some hundred thousand points.
pub const MOST_TEXT: u64 = 8 << 20;

/// Most bytes of a table or log: the journal of the longest plan, ten million points of about a hundred bytes.
pub const MOST_TABLE: u64 = 1 << 30;

/// The contents of a regular file of at most `most` bytes. Pipes and devices are not read: they may have no end.
///
/// # Errors
/// What the file system reports; [`io::ErrorKind::InvalidInput`] for anything but a regular file;
/// [`io::ErrorKind::FileTooLarge`], with the limit, for a larger one.
pub fn read_bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let about = regular(path)?;
    let too_large = |length: u64| {
        let problem = format!("it has {} MiB; at most {} MiB are read", length >> 20, most >> 20);
        io::Error::new(io::ErrorKind::FileTooLarge, problem)
    };
    if about.len() > most {
        return Err(too_large(about.len()));
    }
    let mut bytes = Vec::with_capacity(about.len() as usize);
    // Some files, such as those of the kernel, have more bytes than they state, and others grow.
    let read = File::open(path)?.take(most + 1).read_to_end(&mut bytes)? as u64;
    if read > most { Err(too_large(read)) } else { Ok(bytes) }
}

/// What the file system knows of a regular file. To be asked before it is opened: opening a pipe waits for the other end.
///
/// # Errors
/// What the file system reports; [`io::ErrorKind::InvalidInput`] for anything but a regular file.
pub fn regular(path: &Path) -> io::Result<Metadata> {
    let about = std::fs::metadata(path)?;
    if about.is_file() {
        return Ok(about);
    }
    let problem = if about.is_dir() { "it is a folder" } else { "it is a pipe or a device" };
    let problem = format!("{problem}, not a regular file");
    Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
}

/// The contents of a regular file of at most `most` bytes, as text.
///
/// # Errors
/// As [`read_bytes`]; [`io::ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_bytes(path, most)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        std::fs::write(&path, "12345").expect("written");
        assert_eq!(read_text(&path, 5).expect("small"), "12345");
        let refused = read_bytes(&path, 4).expect_err("too large");
        assert_eq!(refused.kind(), io::ErrorKind::FileTooLarge);
        std::fs::write(&path, b"\xff").expect("written");
        assert_eq!(read_text(&path, 5).expect_err("no text").kind(), io::ErrorKind::InvalidData);
    }

    #[test]
    fn folders_and_devices_are_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        for path in [folder.path(), Path::new("/dev/zero")] {
            let refused = read_bytes(path, 5).expect_err("not regular");
            assert!(refused.to_string().contains("not a regular file"), "{refused}");
        }
    }

    #[test]
    fn a_file_with_more_bytes_than_it_states_is_bounded() {
        // The kernel states a length of 0.
        let refused = read_bytes(Path::new("/proc/self/maps"), 10).expect_err("longer");
        assert_eq!(refused.kind(), io::ErrorKind::FileTooLarge);
    }
}
