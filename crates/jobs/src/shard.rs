//! The run of one shard.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use rayon::ThreadPoolBuilder;

use super::batch::Batch;
use super::error::JobError;
use super::results::{ItemResult, write_head, write_item};
use super::whole_file::WholeFile;
use super::work::{Failure, Product, Threads, Work};

/// An item that has just been done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ItemDone {
    /// Number of the item.
    pub item: usize,
    /// Whether it failed.
    pub failed: bool,
}

/// What a run of a shard was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShardRun {
    /// Its results were there already.
    Known,
    /// It was run.
    Run {
        /// Its items.
        items: usize,
        /// How many of them failed.
        failed: usize,
        /// Time spent in the items, summed over the threads.
        working: Duration,
        /// Time from beginning to end.
        elapsed: Duration,
    },
}

/// Runs a shard on so many threads, and writes its results. `done` is called after each item.
///
/// The results appear at once, when all items are done. Two processes may run the same shard at the same time.
///
/// # Errors
/// [`JobError`] if the batch has no such shard, or if the results cannot be written.
pub fn run_shard(
    batch: &Batch,
    number: usize,
    work: &dyn Work,
    threads: usize,
    done: &(dyn Fn(ItemDone) + Sync),
) -> Result<ShardRun, JobError> {
    if number >= batch.shards() {
        let (folder, last) = (batch.folder().to_owned(), batch.shards() - 1);
        return Err(JobError::NoShard { folder, number, last });
    }
    let path = batch.shard_path(number);
    if path.exists() {
        return Ok(ShardRun::Known);
    }
    let begun = Instant::now();
    let slice = batch.slice(number);
    let threads = threads.max(1);
    let workers = match work.threads() {
        Threads::One => threads.min(slice.len()),
        Threads::All => 1,
    };
    let (next, end) = (&AtomicUsize::new(slice.start), slice.end);
    let write = || -> io::Result<(usize, Duration)> {
        let mut file = WholeFile::begin(&path)?;
        write_head(&mut file, batch, Some(number))?;
        let (mut failed, mut working) = (0, Duration::ZERO);
        std::thread::scope(|scope| {
            // A worker that is far ahead waits.
            let (sender, receiver) = sync_channel::<(ItemResult, Duration)>(workers);
            for _ in 0..workers {
                let sender = sender.clone();
                scope.spawn(move || {
                    let pool = ThreadPoolBuilder::new().num_threads(threads / workers).build().ok();
                    loop {
                        let item = next.fetch_add(1, Ordering::Relaxed);
                        if item >= end {
                            break;
                        }
                        let begun = Instant::now();
                        let product = match &pool {
                            Some(pool) => pool.install(|| run_item(work, batch, item)),
                            // Without threads of its own it uses those of the program.
                            None => run_item(work, batch, item),
                        };
                        done(ItemDone { item, failed: product.is_err() });
                        if sender.send((ItemResult { item, product }, begun.elapsed())).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(sender);
            let (mut early, mut expected) = (BTreeMap::new(), slice.start);
            for (result, took) in receiver {
                working += took;
                failed += usize::from(result.product.is_err());
                early.insert(result.item, result);
                while let Some(result) = early.remove(&expected) {
                    write_item(&mut file, &result)?;
                    expected += 1;
                }
            }
            io::Result::Ok(())
        })?;
        file.flush()?;
        file.finish()?;
        Ok((failed, working))
    };
    let (failed, working) = match write() {
        Ok(done) => done,
        // Another process has finished the same shard, and its batch was merged meanwhile.
        Err(error) if error.kind() == io::ErrorKind::NotFound && path.exists() => {
            return Ok(ShardRun::Known);
        }
        Err(error) => return Err(JobError::writing(&path)(error)),
    };
    Ok(ShardRun::Run { items: slice.len(), failed, working, elapsed: begun.elapsed() })
}

/// Runs an item. An item in which the program fails does not end the others.
fn run_item(work: &dyn Work, batch: &Batch, item: usize) -> Result<Product, Failure> {
    catch_unwind(AssertUnwindSafe(|| work.run(&batch.items()[item]))).unwrap_or_else(|panic| {
        let said = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied());
        Err(Failure::new(format!("internal error: {}", said.unwrap_or("without a message"))))
    })
}
