//! NumPy's .npz archive: a ZIP archive with a .npy file for each array.

use std::io::{Cursor, Read};
use std::sync::Mutex;

use zip::ZipArchive;

use super::npy::{self, HEADER_WITHIN, Header};
use super::{ArrayError, Listed, MOST_ARRAYS, Numbers};

/// An archive in memory.
pub(super) struct Archive(Mutex<ZipArchive<Cursor<Vec<u8>>>>);

impl Archive {
    /// Lists the arrays of numbers; other entries are left out.
    pub(super) fn of(bytes: Vec<u8>) -> Result<(Self, Vec<Listed>), ArrayError> {
        let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| invalid(&error))?;
        let mut listed = Vec::new();
        for index in 0..archive.len().min(MOST_ARRAYS) {
            let entry = archive.by_index(index).map_err(|error| invalid(&error))?;
            let name = entry.name().map_err(|error| invalid(&error))?.into_owned();
            let Some(name) = name.strip_suffix(".npy") else { continue };
            let mut head = Vec::new();
            entry
                .take(HEADER_WITHIN as u64)
                .read_to_end(&mut head)
                .map_err(|error| invalid(&error))?;
            if let Ok(header) = Header::of(&head) {
                listed.push(header.listed(name));
            }
        }
        Ok((Self(Mutex::new(archive)), listed))
    }

    pub(super) fn read(&self, name: &str) -> Result<Numbers, ArrayError> {
        let mut archive = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut entry = archive.by_name(&format!("{name}.npy")).map_err(|error| invalid(&error))?;
        let mut bytes = Vec::new();
        let mut head = entry.by_ref().take(HEADER_WITHIN as u64);
        head.read_to_end(&mut bytes).map_err(|error| invalid(&error))?;
        let header = Header::of(&bytes)?;
        // An archive can state any size: no more is unpacked than the array has.
        let whole = header.length + header.bytes()?;
        let rest = whole.saturating_sub(bytes.len()) as u64;
        entry.take(rest).read_to_end(&mut bytes).map_err(|error| invalid(&error))?;
        npy::read(&bytes)
    }
}

fn invalid(error: &dyn std::fmt::Display) -> ArrayError {
    ArrayError::Invalid(format!("the archive is damaged: {error}"))
}
