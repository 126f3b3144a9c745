//! A batch on this computer.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::batch::Batch;
use super::error::JobError;
use super::shard::{ItemDone, run_shard};
use super::work::{Threads, Work};

/// Runs the missing shards of a batch on so many threads. `done` is called after each item.
///
/// An interrupted batch is continued: only shards without results are run.
///
/// # Errors
/// The first [`JobError`]; shards that are running are then finished.
pub fn run_here(
    batch: &Batch,
    work: &dyn Work,
    threads: usize,
    done: &(dyn Fn(ItemDone) + Sync),
) -> Result<(), JobError> {
    let missing = batch.missing()?;
    let threads = threads.max(1);
    // Several shards at a time keep all threads at work where shards are small; few shards share the threads.
    let at_a_time = match work.threads() {
        Threads::One => threads.min(missing.len()).max(1),
        Threads::All => 1,
    };
    let (next, missing) = (&AtomicUsize::new(0), &missing);
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..at_a_time)
            .map(|_| {
                scope.spawn(move || {
                    while let Some(&shard) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                        if let Err(error) = run_shard(batch, shard, work, threads / at_a_time, done)
                        {
                            next.store(missing.len(), Ordering::Relaxed);
                            return Err(error);
                        }
                    }
                    Ok(())
                })
            })
            .collect();
        runs.into_iter().try_for_each(|run| run.join().expect("a shard's failures are errors"))
    })
}
