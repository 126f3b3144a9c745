//! Bounds of a case: no panic, no more memory and time than stated. A case at fault is kept in `finds`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Most memory of a case, bytes.
pub const MOST_BYTES: usize = 1 << 30;

/// Longest time of a case, seconds.
pub const MOST_SECONDS: u64 = 10;

/// Counts the bytes in use, and the most since a case began.
struct Counting;

#[global_allocator]
static MEMORY: Counting = Counting;
static IN_USE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

fn count(more: usize, fewer: usize) {
    let before = IN_USE.fetch_add(more, Relaxed);
    MOST.fetch_max(before.wrapping_add(more), Relaxed);
    IN_USE.fetch_sub(fewer, Relaxed);
}

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: as the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(0, layout.size());
        // SAFETY: as the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: as the caller's.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size, layout.size());
        // SAFETY: as the caller's.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// The case that runs: since when, of which target, and its bytes.
static RUNS: Mutex<Option<(Instant, &'static str, Vec<u8>)>> = Mutex::new(None);

/// Ends the process when a case takes far too long, and keeps the case.
static TIMEKEEPER: LazyLock<()> = LazyLock::new(|| {
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some((since, target, case)) = &*runs
                && since.elapsed().as_secs() > 3 * MOST_SECONDS
            {
                let path = keep(target, case);
                println!("{target}: a case does not end: {}", path.display());
                std::process::abort();
            }
        }
    });
});

/// Runs a case of a target within the bounds.
///
/// # Panics
/// If the target panics, or exceeds a bound. The case is in `finds`.
pub fn bounded(target: &'static str, case: &[u8], run: impl FnOnce(&[u8])) {
    LazyLock::force(&TIMEKEEPER);
    let since = Instant::now();
    let set = |runs| *RUNS.lock().unwrap_or_else(PoisonError::into_inner) = runs;
    set(Some((since, target, case.to_vec())));
    let before = IN_USE.load(Relaxed);
    MOST.store(before, Relaxed);
    let ended = catch_unwind(AssertUnwindSafe(|| run(case)));
    set(None);
    let taken = MOST.load(Relaxed).saturating_sub(before);
    let seconds = since.elapsed().as_secs();
    if ended.is_err() || taken > MOST_BYTES || seconds >= MOST_SECONDS {
        let path = keep(target, case);
        println!("{target}: {} MiB, {seconds} s: {}", taken >> 20, path.display());
    }
    if let Err(panic) = ended {
        resume_unwind(panic);
    }
    assert!(taken <= MOST_BYTES, "{target} took {} MiB", taken >> 20);
    assert!(seconds < MOST_SECONDS, "{target} took {seconds} s");
}

/// Keeps a case at fault.
fn keep(target: &str, case: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("finds").join(target);
    let sum = case.iter().fold(0u64, |sum, byte| {
        sum.wrapping_mul(0x0100_0000_01b3).wrapping_add(u64::from(*byte) + 1)
    });
    let path = folder.join(format!("{sum:016x}"));
    let kept = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, case));
    kept.unwrap_or_else(|error| println!("{} cannot be kept: {error}", path.display()));
    path
}
