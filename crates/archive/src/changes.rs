//! Which folders below a folder are records, and whether their files changed since they were read.

use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rayon::prelude::*;

use crate::early_report::COMPARISON;
use crate::figures::{FIGURES, REPORT, WHY};

/// What makes a folder a record.
const SET_UP: &str = "scan.toml";

/// File systems of the network keep times to one or two seconds: a file changed twice within this may have the same time and length.
const COARSEST_CLOCK: Duration = Duration::from_secs(2);

/// The times and lengths of the files of a record that are indexed, at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stamp(Vec<u8>);

/// A record that was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Found {
    /// Its folder below the root.
    pub folder: PathBuf,
    /// Its files as they are.
    pub stamp: Stamp,
    /// Whether all its files are older than the coarsest clock can hide a change.
    pub settled: bool,
}

/// What a search below a folder found.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// The records, in the [order](by_bytes) of their folders.
    pub records: Vec<Found>,
    /// Folders that cannot be read, with the reason.
    pub unreadable: Vec<(PathBuf, io::Error)>,
}

impl Stamp {
    /// As it is stored.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// Whether a folder is a record.
pub(crate) fn is_record(folder: &Path) -> bool {
    set_up(folder).is_some()
}

/// What the file system says of the set-up in a folder, or of the link in its place.
fn set_up(folder: &Path) -> Option<Metadata> {
    folder.join(SET_UP).symlink_metadata().ok()
}

/// The order of folders, byte by byte: comparing paths part by part takes longer than a look at their files.
pub(crate) fn by_bytes(a: &Path, b: &Path) -> std::cmp::Ordering {
    a.as_os_str().as_encoded_bytes().cmp(b.as_os_str().as_encoded_bytes())
}

/// The records below `root`. Records in a record, hidden folders and links are left out.
///
/// # Errors
/// The root cannot be read.
pub(crate) fn records_below(root: &Path) -> io::Result<Search> {
    let now = SystemTime::now();
    if let Some(set_up) = set_up(root) {
        let records = vec![Found::of(root, PathBuf::new(), set_up, now)];
        return Ok(Search { records, ..Search::default() });
    }
    let Search { mut records, mut unreadable } = Search::default();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let inside = match folders_in(&root.join(&folder)) {
            Ok(inside) => inside,
            Err(error) if folder.as_os_str().is_empty() => return Err(error),
            // Removed while its parent was read.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => {
                unreadable.push((folder, error));
                continue;
            }
        };
        let found: Vec<Result<Found, PathBuf>> = inside
            .into_par_iter()
            .map(|name| {
                let below = folder.join(name);
                let path = root.join(&below);
                match set_up(&path) {
                    Some(set_up) => Ok(Found::of(&path, below, set_up, now)),
                    None => Err(below),
                }
            })
            .collect();
        for found in found {
            match found {
                Ok(record) => records.push(record),
                Err(folder) => folders.push(folder),
            }
        }
    }
    records.sort_by(|a, b| by_bytes(&a.folder, &b.folder));
    unreadable.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(Search { records, unreadable })
}

/// The folders in a folder, without hidden ones and links.
fn folders_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut inside = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        if entry.file_type()?.is_dir() && !name.as_encoded_bytes().starts_with(b".") {
            inside.push(PathBuf::from(name));
        }
    }
    Ok(inside)
}

impl Found {
    fn of(path: &Path, folder: PathBuf, set_up: Metadata, now: SystemTime) -> Self {
        // The file that a link leads to is the one that changes.
        let set_up = if set_up.is_symlink() { about(&path.join(SET_UP)) } else { Some(set_up) };
        let report = path.join(REPORT);
        let figures = about(&report.join(FIGURES));
        let why = report.join(WHY).join(FIGURES);
        // A file that is replaced or added changes the time of its folder; only what is written in place needs a look of its own.
        let mut files = vec![about(path), set_up, about(&path.join("notes.jsonl"))];
        match figures {
            Some(_) => files.push(about(&why)),
            None => files.push(about(&report.join(COMPARISON))),
        }
        files.push(figures);
        let limit = now.checked_sub(COARSEST_CLOCK);
        let old = |about: &Metadata| {
            about.modified().ok().zip(limit).is_some_and(|(at, limit)| at < limit)
        };
        let settled = files.iter().flatten().all(old);
        let mut bytes = Vec::with_capacity(24 * files.len());
        for file in &files {
            let numbers = file.as_ref().map_or([0; 3], |about| {
                // The length of a folder depends on the file system, and says nothing.
                let length = if about.is_dir() { 0 } else { about.len() };
                [about.mtime(), about.mtime_nsec(), length as i64]
            });
            bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        }
        Self { folder, stamp: Stamp(bytes), settled }
    }
}

fn about(path: &Path) -> Option<Metadata> {
    fs::metadata(path).ok()
}
