//! Shards that failed, with the end of their logs.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use fieldgap_input::regular;

use super::task_state::{TaskReport, TaskState};
use crate::batch::Batch;
use crate::error::FailedShard;

/// Bytes at the end of a log that are read, and lines of them that are shown.
const END_BYTES: u64 = 4096;
const END_LINES: usize = 5;

/// A shard that failed, by what Slurm says of its tasks.
pub(super) fn failed_shard(batch: &Batch, number: usize, reports: &[TaskReport]) -> FailedShard {
    let own = |report: &&TaskReport| {
        u32::try_from(number).is_ok_and(|number| report.tasks.contains(number))
    };
    // A word of failure says more than that the task ended.
    let state = reports.iter().filter(own).find_map(|report| match &report.state {
        TaskState::Failed(word) => Some(word.clone()),
        _ => None,
    });
    let ended = reports.iter().filter(own).any(|report| report.state == TaskState::Completed);
    let log = batch.folder().join("logs").join(format!("{number}.log"));
    FailedShard {
        number,
        state: state.or_else(|| ended.then(|| "ended without results".to_owned())),
        last_lines: last_lines(&log),
        log,
    }
}

fn last_lines(log: &Path) -> Option<String> {
    let length = regular(log).ok()?.len();
    let mut file = File::open(log).ok()?;
    file.seek(SeekFrom::Start(length.saturating_sub(END_BYTES))).ok()?;
    let mut bytes = Vec::new();
    file.take(END_BYTES).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    Some(lines[lines.len().saturating_sub(END_LINES)..].join("\n"))
}
