//! Where the index of a folder lies.

use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};

use crate::changes::is_record;

/// Name of the index in the folder that it indexes.
const BESIDE: &str = ".fieldgap-index.sqlite";

/// Where an index lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In the folder that it indexes.
    Beside(PathBuf),
    /// In the user's cache, as that folder cannot be written, or is itself a record.
    Cache(PathBuf),
    /// In memory, as there is no cache either.
    Memory,
}

impl Place {
    /// Where the index of `root` lies; `cache` is the folder for what can be made again.
    pub fn of(root: &Path, cache: Option<&Path>) -> Self {
        let beside = root.join(BESIDE);
        // A record holds what was measured, and nothing else.
        if !is_record(root)
            && can_be_written(root)
            && (!beside.exists() || is_writable_file(&beside))
        {
            return Self::Beside(beside);
        }
        let Some(cache) = cache else { return Self::Memory };
        let root = std::fs::canonicalize(root).unwrap_or_else(|_| root.to_owned());
        let name = format!("index-{:016x}.sqlite", fnv1a(root.as_os_str().as_encoded_bytes()));
        match std::fs::create_dir_all(cache) {
            Ok(()) if can_be_written(cache) => Self::Cache(cache.join(name)),
            _ => Self::Memory,
        }
    }

    /// The user's folder for what can be made again: `$XDG_CACHE_HOME/fieldgap`, or `~/.cache/fieldgap`.
    pub fn user_cache() -> Option<PathBuf> {
        let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        let cache = set("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .or_else(|| set("HOME").map(|home| PathBuf::from(home).join(".cache")))?;
        cache.is_absolute().then(|| cache.join("fieldgap"))
    }

    /// The file; `None` in memory.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Beside(path) | Self::Cache(path) => Some(path),
            Self::Memory => None,
        }
    }
}

fn can_be_written(path: &Path) -> bool {
    access(path, Access::WRITE_OK).is_ok()
}

fn is_writable_file(path: &Path) -> bool {
    path.is_file() && can_be_written(path)
}

/// The hash of Fowler, Noll and Vo, 64 bit: the same in every version of this program.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_its_authors() {
        // Test vectors of the draft `draft-eastlake-fnv`.
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn an_index_lies_in_its_folder_unless_it_cannot() {
        let folder = tempfile::tempdir().expect("a folder");
        let cache = tempfile::tempdir().expect("a folder");
        let place = || Place::of(folder.path(), Some(cache.path()));
        assert_eq!(place(), Place::Beside(folder.path().join(BESIDE)));
        std::fs::create_dir(folder.path().join(BESIDE)).expect("in the way");
        assert!(place().file().is_some_and(|file| file.starts_with(cache.path())), "{:?}", place());
        assert_eq!(Place::of(folder.path(), None), Place::Memory);
        let record = tempfile::tempdir().expect("a folder");
        std::fs::write(record.path().join("scan.toml"), "").expect("written");
        assert!(matches!(Place::of(record.path(), Some(cache.path())), Place::Cache(_)));
    }
}
