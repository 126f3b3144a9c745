//! A batch: work in a folder.

use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use fieldgap_input::{MOST_TABLE, read_bytes};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::error::JobError;
use super::whole_file::{WholeFile, write_whole};
use super::work::Work;

/// Format of `batch.json` and of the results.
pub(crate) const FORMAT: u32 = 1;

/// Shards of a batch where nothing else is asked for: few enough for a folder and for an array job of Slurm's usual size (1,001), enough
/// that little is lost with one of them.
pub const USUAL_SHARDS: usize = 1000;

/// Work in a folder.
#[derive(Debug, Clone)]
pub struct Batch {
    folder: PathBuf,
    contents: Contents,
}

/// How a new batch is made.
#[derive(Debug, Clone, Copy)]
pub struct MakeBatch<'m> {
    /// The program and its version: all shards must be run by the same one.
    pub software: &'m str,
    /// When the batch is made, as text.
    pub made: &'m str,
    /// Number of shards; there are never more than items.
    pub shards: usize,
}

/// Contents of `batch.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Contents {
    format: u32,
    kind: String,
    software: String,
    made: String,
    /// SHA-256 of kind, software, work and items.
    digest: String,
    shards: usize,
    work: Value,
    items: Vec<Value>,
}

impl Contents {
    fn new(work: &dyn Work, make: &MakeBatch<'_>) -> Self {
        let items = work.items();
        let mut contents = Self {
            format: FORMAT,
            kind: work.kind().to_owned(),
            software: make.software.to_owned(),
            made: make.made.to_owned(),
            digest: String::new(),
            shards: make.shards.clamp(1, items.len().max(1)),
            work: work.description(),
            items,
        };
        contents.digest = contents.true_digest();
        contents
    }

    fn true_digest(&self) -> String {
        let digested = (&self.kind, &self.software, &self.work, &self.items);
        let bytes = serde_json::to_vec(&digested).expect("values with text as keys have JSON");
        Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Batch {
    /// Makes a batch, or opens the one of the same work.
    ///
    /// # Errors
    /// [`JobError`] if the folder has another batch, if there is nothing to do, or if the folder cannot be written.
    pub fn make_or_open(
        folder: &Path,
        work: &dyn Work,
        make: &MakeBatch<'_>,
    ) -> Result<Self, JobError> {
        let wanted = Contents::new(work, make);
        if wanted.items.is_empty() {
            return Err(JobError::NoItems);
        }
        match Self::open(folder) {
            Err(JobError::NoBatch(_)) => {}
            Err(error) => return Err(error),
            Ok(batch) => {
                batch.is_by(make.software)?;
                if let Some(differs) = difference(&batch.contents, &wanted) {
                    return Err(JobError::AnotherWork { folder: folder.to_owned(), differs });
                }
                return Ok(batch);
            }
        }
        let shards = folder.join("shards");
        fs::create_dir_all(&shards).map_err(JobError::writing(&shards))?;
        let folder = folder.canonicalize().map_err(JobError::reading(folder))?;
        let batch = Self { folder, contents: wanted };
        let bytes = serde_json::to_vec(&batch.contents).expect("values have JSON");
        // Last: a folder that has it is complete.
        let path = batch.folder.join("batch.json");
        write_whole(&path, &bytes).map_err(JobError::writing(&path))?;
        Ok(batch)
    }

    /// Opens the batch in a folder.
    ///
    /// # Errors
    /// [`JobError`] if there is none, or if it is damaged.
    pub fn open(folder: &Path) -> Result<Self, JobError> {
        let path = folder.join("batch.json");
        let bytes = read_bytes(&path, MOST_TABLE).map_err(|error| match error.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => JobError::NoBatch(folder.to_owned()),
            _ => JobError::Read { path: path.clone(), source: error },
        })?;
        let folder = folder.canonicalize().map_err(JobError::reading(folder))?;
        Self::parse(folder, &bytes)
    }

    /// Reads `bytes` as the `batch.json` of a folder.
    ///
    /// # Errors
    /// [`JobError::NotABatch`] if they are not.
    pub fn parse(folder: PathBuf, bytes: &[u8]) -> Result<Self, JobError> {
        let not_a_batch =
            |problem| JobError::NotABatch { path: folder.join("batch.json"), problem };
        let contents: Contents =
            serde_json::from_slice(bytes).map_err(|error| not_a_batch(error.to_string()))?;
        if contents.format != FORMAT {
            let problem =
                format!("its format is {}, and this program reads {FORMAT}", contents.format);
            return Err(not_a_batch(problem));
        }
        if !(1..=contents.items.len()).contains(&contents.shards) {
            let (shards, items) = (contents.shards, contents.items.len());
            return Err(not_a_batch(format!("it has {shards} shards of {items} items")));
        }
        if contents.digest != contents.true_digest() {
            return Err(not_a_batch("its digest is not that of its contents".to_owned()));
        }
        Ok(Self { folder, contents })
    }

    /// Checks that `software` made the batch.
    ///
    /// # Errors
    /// [`JobError::OtherSoftware`] if not.
    pub fn is_by(&self, software: &str) -> Result<(), JobError> {
        if self.contents.software == software {
            return Ok(());
        }
        Err(JobError::OtherSoftware {
            folder: self.folder.clone(),
            batch: self.contents.software.clone(),
            own: software.to_owned(),
        })
    }

    /// Checks that the batch is of this kind of work, described in this way. Its items may be others: what lies in a folder changes.
    ///
    /// # Errors
    /// [`JobError::AnotherWork`] if not.
    pub fn is_of(&self, work: &dyn Work) -> Result<(), JobError> {
        let another = |differs| JobError::AnotherWork { folder: self.folder.clone(), differs };
        if self.contents.kind != work.kind() {
            return Err(another("kind of work"));
        }
        match self.contents.work == work.description() {
            true => Ok(()),
            false => Err(another("description of the work")),
        }
    }

    /// The folder, an absolute path.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The kind of work.
    pub fn kind(&self) -> &str {
        &self.contents.kind
    }

    /// The program that made it.
    pub fn software(&self) -> &str {
        &self.contents.software
    }

    /// When it was made.
    pub fn made(&self) -> &str {
        &self.contents.made
    }

    /// SHA-256 of the work and the software, in hexadecimal digits.
    pub fn digest(&self) -> &str {
        &self.contents.digest
    }

    /// What the work needs besides its items.
    pub fn description(&self) -> &Value {
        &self.contents.work
    }

    /// The items.
    pub fn items(&self) -> &[Value] {
        &self.contents.items
    }

    /// Number of shards.
    pub fn shards(&self) -> usize {
        self.contents.shards
    }

    /// The items of a shard.
    pub(crate) fn slice(&self, shard: usize) -> Range<usize> {
        let edge = |shard: usize| {
            let items = self.contents.items.len() as u128;
            (shard as u128 * items / self.contents.shards as u128) as usize
        };
        edge(shard)..edge(shard + 1)
    }

    /// The file of a shard's results.
    pub fn shard_path(&self, shard: usize) -> PathBuf {
        self.folder.join("shards").join(format!("{shard:05}.jsonl"))
    }

    /// The file of all results.
    pub fn merged_path(&self) -> PathBuf {
        self.folder.join("merged.jsonl")
    }

    /// The shards without results, ascending.
    ///
    /// # Errors
    /// [`JobError::Read`] if the folder cannot be read.
    pub fn missing(&self) -> Result<Vec<usize>, JobError> {
        let folder = self.folder.join("shards");
        let mut there = vec![false; self.shards()];
        for entry in fs::read_dir(&folder).map_err(JobError::reading(&folder))? {
            let name = entry.map_err(JobError::reading(&folder))?.file_name();
            let number = name.to_str().and_then(|name| name.strip_suffix(".jsonl")?.parse().ok());
            if let Some(there) = number.and_then(|number: usize| there.get_mut(number)) {
                *there = true;
            }
        }
        Ok((0..self.shards()).filter(|&shard| !there[shard]).collect())
    }

    /// As [`Batch::missing`], when another computer may have written results just now.
    ///
    /// A computer remembers the list of a folder on a network file system, for half a minute and more (`acdirmin` of nfs(5)). A change of its own
    /// makes it ask anew, because the answer to it tells that others have changed the folder as well (RFC 8881, section 10.8.1).
    ///
    /// # Errors
    /// [`JobError`] if the folder cannot be read or written.
    pub fn missing_now(&self) -> Result<Vec<usize>, JobError> {
        let path = self.folder.join("shards").join("look");
        // It is never finished, and removed at once.
        drop(WholeFile::begin(&path).map_err(JobError::writing(&path))?);
        self.missing()
    }

    /// Items of the shards that are missing.
    pub fn items_of(&self, shards: &[usize]) -> usize {
        shards.iter().map(|&shard| self.slice(shard).len()).sum()
    }
}

/// The first thing in which two batches differ. The number of shards is no difference: the results are the same.
fn difference(one: &Contents, other: &Contents) -> Option<&'static str> {
    if one.kind != other.kind {
        Some("kind of work")
    } else if one.work != other.work {
        Some("description of the work")
    } else if one.items != other.items {
        Some("list of items")
    } else {
        None
    }
}
