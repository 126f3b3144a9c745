//! What was given to Slurm: `slurm.json` in the folder of a batch.

use std::io::ErrorKind;
use std::path::PathBuf;

use fieldgap_input::{MOST_TEXT, read_bytes};
use serde::{Deserialize, Serialize};

use super::numbers::TaskNumbers;
use crate::batch::Batch;
use crate::error::JobError;
use crate::whole_file::write_whole;

/// Contents of `slurm.json`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sent {
    /// The jobs, in the order in which they were sent.
    pub jobs: Vec<SentJob>,
    /// Whether shards failed that had been sent twice.
    pub given_up: bool,
}

/// One array job.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SentJob {
    /// Its number.
    pub job: u64,
    /// Its tasks, as Slurm writes them.
    pub tasks: String,
}

impl SentJob {
    /// Whether a shard was sent with this job.
    pub fn has(&self, shard: usize) -> bool {
        let tasks = self.tasks.parse::<TaskNumbers>().unwrap_or_default();
        u32::try_from(shard).is_ok_and(|shard| tasks.contains(shard))
    }
}

impl Sent {
    fn path(batch: &Batch) -> PathBuf {
        batch.folder().join("slurm.json")
    }

    /// What was sent of a batch; nothing if there is no file.
    pub fn read(batch: &Batch) -> Result<Self, JobError> {
        let path = Self::path(batch);
        match read_bytes(&path, MOST_TEXT) {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .map_err(|error| JobError::NotABatch { path, problem: error.to_string() }),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(Self::default()),
            Err(source) => Err(JobError::Read { path, source }),
        }
    }

    /// Keeps it.
    pub fn write(&self, batch: &Batch) -> Result<(), JobError> {
        let path = Self::path(batch);
        let bytes = serde_json::to_vec(self).expect("numbers and texts have JSON");
        write_whole(&path, &bytes).map_err(JobError::writing(&path))
    }
}
