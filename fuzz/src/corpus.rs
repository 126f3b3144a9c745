//! The kept cases of a target.

use std::path::{Path, PathBuf};

/// The folder of a target's cases.
pub fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target)
}

/// The cases of a target, in the order of their names.
///
/// # Panics
/// If there is none.
pub fn cases(target: &str) -> Vec<Vec<u8>> {
    let folder = folder(target);
    let entries = std::fs::read_dir(&folder).expect("the corpus has a folder for each target");
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| path.is_file());
    paths.sort();
    assert!(!paths.is_empty(), "{} has no case", folder.display());
    paths.iter().map(|path| std::fs::read(path).expect("a case can be read")).collect()
}
