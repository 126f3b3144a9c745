//! A field on many planes, written plane by plane: `volume.npy`, which NumPy can map into memory, and `volume.toml`, which describes
//! the set-up.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use fieldgap_input::{MOST_TEXT, read_text, regular};

use super::durable;

/// Bytes of a value (`<f4`).
const VALUE_BYTES: u64 = 4;

/// Why a volume cannot be written to a folder.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum VolumeError {
    /// There is another volume.
    #[error("{} describes another volume; choose another folder, or move that volume away", .0.display())]
    Another(PathBuf),
    /// The file is not a volume of this shape.
    #[error("{} is not the volume that {} describes; remove both to start again", .0.display(), .1.display())]
    Damaged(PathBuf, PathBuf),
    /// The file system refused.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

/// A volume that grows by complete planes, each on disk before [`VolumeFile::append`] returns.
#[derive(Debug)]
pub struct VolumeFile {
    file: File,
    path: PathBuf,
    shape: [usize; 3],
    done: usize,
}

impl VolumeFile {
    /// Starts a volume of planes, rows and columns in a folder, which is created if necessary. If the folder has a volume with the same
    /// description, that one is continued, and an incomplete plane is cut off.
    ///
    /// # Errors
    /// [`VolumeError`] if the folder contains another volume or cannot be written.
    pub fn open(folder: &Path, description: &str, shape: [usize; 3]) -> Result<Self, VolumeError> {
        let path = folder.join("volume.npy");
        let described = folder.join("volume.toml");
        let refused = |path: &Path| {
            let path = path.to_owned();
            move |source| VolumeError::Write { path, source }
        };
        let header = header(shape);
        if described.exists() {
            if read_text(&described, MOST_TEXT).map_err(refused(&described))? != description {
                return Err(VolumeError::Another(described));
            }
            let mut file = regular(&path)
                .and_then(|_| OpenOptions::new().read(true).write(true).open(&path))
                .map_err(refused(&path))?;
            let mut found = vec![0; header.len()];
            if file.read_exact(&mut found).is_err() || found != header {
                return Err(VolumeError::Damaged(path, described));
            }
            let length = file.metadata().map_err(refused(&path))?.len();
            let plane = plane_bytes(shape);
            let done = ((length - header.len() as u64) / plane).min(shape[0] as u64);
            let whole = header.len() as u64 + done * plane;
            file.set_len(whole)
                .and_then(|()| file.seek(SeekFrom::Start(whole)))
                .map_err(refused(&path))?;
            return Ok(Self { file, path, shape, done: done as usize });
        }
        fs::create_dir_all(folder).map_err(refused(folder))?;
        let mut file = File::create(&path).map_err(refused(&path))?;
        file.write_all(&header).and_then(|()| file.sync_all()).map_err(refused(&path))?;
        // Last: a folder that has it has a volume that can be continued.
        durable::replace(&described, description.as_bytes()).map_err(refused(&described))?;
        Ok(Self { file, path, shape, done: 0 })
    }

    /// Number of planes on disk.
    pub fn done(&self) -> usize {
        self.done
    }

    /// The file of the values.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds the next plane, row by row.
    ///
    /// # Errors
    /// [`VolumeError::Write`]; the plane then counts as not written.
    ///
    /// # Panics
    /// If the plane has another size than the others, or the volume is complete.
    pub fn append(&mut self, values: &[f32]) -> Result<(), VolumeError> {
        assert_eq!(values.len(), self.shape[1] * self.shape[2], "as many values as a plane has");
        assert!(self.done < self.shape[0], "no more planes than were announced");
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.file
            .write_all(&bytes)
            .and_then(|()| self.file.sync_data())
            .map_err(|source| VolumeError::Write { path: self.path.clone(), source })?;
        self.done += 1;
        Ok(())
    }
}

fn plane_bytes(shape: [usize; 3]) -> u64 {
    (shape[1] * shape[2]) as u64 * VALUE_BYTES
}

/// The header of the NPY format, version 1.0 (NumPy Enhancement Proposal 1), padded to a multiple of 64 bytes.
fn header(shape: [usize; 3]) -> Vec<u8> {
    let [planes, rows, columns] = shape;
    let mut text = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({planes}, {rows}, {columns}), }}"
    );
    let before = b"\x93NUMPY\x01\x00".len() + 2;
    while !(before + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend(u16::try_from(text.len()).expect("three numbers are short").to_le_bytes());
    header.extend(text.as_bytes());
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_that_was_cut_short_goes_on_after_its_last_whole_plane() {
        let folder = tempfile::tempdir().expect("a folder");
        let shape = [3, 2, 2];
        let mut volume = VolumeFile::open(folder.path(), "d = 1\n", shape).expect("begun");
        volume.append(&[1.0, 2.0, 3.0, 4.0]).expect("kept");
        volume.append(&[5.0, 6.0, 7.0, 8.0]).expect("kept");
        let path = volume.path().to_owned();
        drop(volume);
        // As if the power had gone in the middle of the second plane.
        let file = OpenOptions::new().write(true).open(&path).expect("there");
        file.set_len(128 + 16 + 5).expect("cut");
        let mut again = VolumeFile::open(folder.path(), "d = 1\n", shape).expect("gone on with");
        assert_eq!(again.done(), 1);
        again.append(&[9.0; 4]).expect("kept");
        again.append(&[10.0; 4]).expect("kept");
        let bytes = fs::read(&path).expect("there");
        assert_eq!(bytes.len(), 128 + 3 * 16);
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let text = String::from_utf8_lossy(&bytes[10..128]).into_owned();
        assert!(text.contains("'shape': (3, 2, 2)") && text.ends_with('\n'), "{text}");
        assert_eq!(bytes[128 + 12..128 + 20], [4f32.to_le_bytes(), 9f32.to_le_bytes()].concat());
    }

    #[test]
    fn another_volume_is_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        VolumeFile::open(folder.path(), "d = 1\n", [1, 1, 1]).expect("begun");
        let other = VolumeFile::open(folder.path(), "d = 2\n", [1, 1, 1]);
        assert!(matches!(other, Err(VolumeError::Another(_))));
        let shape = VolumeFile::open(folder.path(), "d = 1\n", [2, 1, 1]);
        assert!(matches!(shape, Err(VolumeError::Damaged(..))));
    }
}
