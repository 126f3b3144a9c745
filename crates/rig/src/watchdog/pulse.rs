//! Whether the work of a program responds, apart from the thread that beats.

use std::future::poll_fn;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval};

use super::BEAT_EVERY;

/// No work is followed.
const NONE: u64 = u64::MAX;

/// When the work last responded.
#[derive(Debug)]
pub(super) struct Pulse {
    begun: Instant,
    /// Milliseconds from `begun`.
    responded_ms: AtomicU64,
}

impl Default for Pulse {
    fn default() -> Self {
        Self { begun: Instant::now(), responded_ms: AtomicU64::new(NONE) }
    }
}

impl Pulse {
    /// For how long the work has not responded; zero if none is followed.
    pub fn unresponsive_for(&self) -> Duration {
        match self.responded_ms.load(Ordering::Relaxed) {
            NONE => Duration::ZERO,
            then => self.begun.elapsed().saturating_sub(Duration::from_millis(then)),
        }
    }

    fn responds(&self) {
        self.responded_ms.store(self.begun.elapsed().as_millis() as u64, Ordering::Relaxed);
    }
}

/// The work is over.
struct Over<'p>(&'p Pulse);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.responded_ms.store(NONE, Ordering::Relaxed);
    }
}

/// Shows the guard that work responds.
#[derive(Debug)]
pub struct Follower(Arc<Pulse>);

impl Follower {
    pub(super) fn new(pulse: Arc<Pulse>) -> Self {
        Self(pulse)
    }

    /// Does `work`, and notes that it responds, at every turn that it gets and at least four times a second. If it keeps its
    /// thread to itself for [`SLOW_AT_MOST`](super::SLOW_AT_MOST), the guard takes the program for lost.
    pub async fn follow<T>(self, work: impl Future<Output = T>) -> T {
        let Self(pulse) = self;
        let mut work = pin!(work);
        let mut turns = interval(BEAT_EVERY);
        turns.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let _over = Over(&pulse);
        poll_fn(|context| {
            pulse.responds();
            while turns.poll_tick(context).is_ready() {}
            work.as_mut().poll(context)
        })
        .await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn work_that_blocks_its_thread_does_not_respond_and_work_that_waits_does() {
        let pulse = Arc::new(Pulse::default());
        let (tell, told) = std::sync::mpsc::channel();
        let seen = Arc::clone(&pulse);
        let work = Follower::new(Arc::clone(&pulse)).follow(async move {
            tokio::time::sleep(3 * BEAT_EVERY).await;
            tell.send(seen.unresponsive_for()).expect("it listens");
            // Blocks the thread, as a deadlock would.
            std::thread::sleep(2 * BEAT_EVERY);
            tell.send(seen.unresponsive_for()).expect("it listens");
        });
        work.await;
        let [waited, blocked] = [told.recv(), told.recv()].map(|said| said.expect("it was said"));
        assert!(waited < blocked && blocked >= 2 * BEAT_EVERY, "{waited:?}, {blocked:?}");
        assert_eq!(pulse.unresponsive_for(), Duration::ZERO);
    }
}
