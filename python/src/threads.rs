//! The threads of a call, and calls that Ctrl-C ends.
//!
//! The pools are this package's own and are kept by process: a child made by `fork`, as `multiprocessing` makes it on Linux, has none of its
//! parent's threads and gets a pool of its own.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{argument_error, other_error};

/// Most threads of a call.
const MOST_THREADS: usize = 1024;

/// How often a long call asks whether Ctrl-C was pressed: too short a time for a person to notice.
const BETWEEN_SIGNAL_CHECKS: Duration = Duration::from_millis(50);

/// A process and the number of threads of one of its pools; 0 stands for all cores.
type Key = (u32, usize);

static POOLS: Mutex<BTreeMap<Key, Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

fn key(threads: Option<usize>) -> Key {
    (std::process::id(), threads.unwrap_or(0))
}

/// The pool of a call with a number of threads; `None` for all cores.
pub fn pool(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    if threads.is_some_and(|threads| !(1..=MOST_THREADS).contains(&threads)) {
        return Err(argument_error(format!(
            "threads is {}; a number from 1 to {MOST_THREADS} is needed, or None for all cores",
            threads.unwrap_or(0)
        )));
    }
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&key(threads)) {
        return Ok(Arc::clone(pool));
    }
    let built = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = Arc::new(built.map_err(|error| other_error(&error))?);
    pools.insert(key(threads), Arc::clone(&pool));
    Ok(pool)
}

/// Does long work without the interpreter's lock. After Ctrl-C the call ends at once with `KeyboardInterrupt`; the work itself cannot be
/// stopped and ends on a pool that no other call uses.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let (sender, receiver) = channel();
    pool.spawn(move || {
        // Nobody receives the result of an abandoned call.
        let _ = sender.send(catch_unwind(AssertUnwindSafe(work)));
    });
    let receiver = Mutex::new(receiver);
    loop {
        let received = py.detach(|| {
            let receiver = receiver.lock().unwrap_or_else(PoisonError::into_inner);
            receiver.recv_timeout(BETWEEN_SIGNAL_CHECKS)
        });
        match received {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {}
            Err(error @ RecvTimeoutError::Disconnected) => return Err(other_error(&error)),
        }
        if let Err(interrupt) = py.check_signals() {
            POOLS.lock().unwrap_or_else(PoisonError::into_inner).remove(&key(threads));
            return Err(interrupt);
        }
    }
}
