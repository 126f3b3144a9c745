//! The results of all shards in one file, in the order of the items.

use std::fs;
use std::io::Write;

use super::batch::Batch;
use super::error::JobError;
use super::results::{Results, write_head};
use super::whole_file::{UNFINISHED, WholeFile};

impl Batch {
    /// The results of all items, in order. They are merged if they are not yet.
    ///
    /// # Errors
    /// [`JobError::Unfinished`] if shards are missing, [`JobError::Damaged`] if one is damaged.
    pub fn results(&self) -> Result<Results, JobError> {
        let path = self.merged_path();
        if !path.exists() {
            self.merge()?;
        }
        Results::open(&path, self, None)
    }

    /// Merges the shards, line by line, so that memory does not grow with them.
    fn merge(&self) -> Result<(), JobError> {
        let missing = self.missing()?.len();
        if missing > 0 {
            let (folder, shards) = (self.folder().to_owned(), self.shards());
            return Err(JobError::Unfinished { folder, missing, shards });
        }
        let path = self.merged_path();
        let writing = || JobError::writing(&path);
        let mut merged = WholeFile::begin(&path).map_err(writing())?;
        write_head(&mut merged, self, None).map_err(writing())?;
        for shard in 0..self.shards() {
            let mut results = Results::open(&self.shard_path(shard), self, Some(shard))?;
            while let Some(line) = results.next_line() {
                merged.write_all(line?.0).map_err(writing())?;
            }
        }
        merged.finish().map_err(writing())?;
        self.remove_unfinished();
        Ok(())
    }

    /// Removes what killed processes left. A process that still runs one of the shards in vain then fails, and nothing is lost.
    fn remove_unfinished(&self) {
        let Ok(entries) = fs::read_dir(self.folder().join("shards")) else { return };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.to_string_lossy().ends_with(UNFINISHED) {
                let _ = fs::remove_file(path);
            }
        }
    }
}
