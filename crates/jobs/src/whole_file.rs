//! Files that appear whole or not at all, also when several processes on several computers write the same one.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use fieldgap_records::sync_folder;

/// Ending of files that are being written.
pub(crate) const UNFINISHED: &str = ".part";

/// Files that this process has begun, so that their names differ.
static BEGUN: AtomicUsize = AtomicUsize::new(0);

/// A file that is being written beside its final place.
pub(crate) struct WholeFile {
    writer: Option<BufWriter<File>>,
    beside: PathBuf,
    path: PathBuf,
}

impl WholeFile {
    /// Begins a file. Its name until it is finished has the computer and the process in it: no two writers share it.
    pub fn begin(path: &Path) -> io::Result<Self> {
        let computer = rustix::system::uname().nodename().to_string_lossy().replace('/', "-");
        let number = BEGUN.fetch_add(1, Ordering::Relaxed);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let beside = path.with_file_name(format!(
            ".{name}.{computer}.{}.{number}{UNFINISHED}",
            std::process::id()
        ));
        Ok(Self {
            writer: Some(BufWriter::new(File::create(&beside)?)),
            beside,
            path: path.to_owned(),
        })
    }

    /// Finishes the file: it is on disk, and then has its name. It replaces a file of that name.
    pub fn finish(mut self) -> io::Result<()> {
        let writer = self.writer.take().expect("it is finished once");
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync_all()?;
        drop(file);
        fs::rename(&self.beside, &self.path)?;
        sync_folder(self.path.parent().unwrap_or(Path::new("")))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.as_mut().expect("it is not finished").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().expect("it is not finished").flush()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        // After an error; a file that was finished no longer has this name.
        let _ = fs::remove_file(&self.beside);
    }
}

/// Writes a whole file.
pub(crate) fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::begin(path)?;
    file.write_all(contents)?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_when_it_is_finished_and_an_unfinished_one_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        let (mut one, mut other) =
            (WholeFile::begin(&path).expect("begun"), WholeFile::begin(&path).expect("begun"));
        one.write_all(b"one").and_then(|()| other.write_all(b"other")).expect("written");
        assert!(!path.exists());
        one.finish().expect("finished");
        assert_eq!(fs::read(&path).expect("there"), b"one");
        drop(other);
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }
}
