//! Suspensions of the computer: time that passes while no program runs.

use std::time::Duration;

use rustix::time::{ClockId, Timespec, clock_gettime};

/// Shortest suspension that counts: the two clocks are read one after the other.
const SHORTEST: Duration = Duration::from_secs(1);

/// Tells for how long the computer was suspended since its start.
pub type SuspensionClock = Box<dyn Fn() -> Duration + Send>;

/// Notices suspensions.
pub(super) struct Suspensions {
    clock: SuspensionClock,
    /// What the clock said when a suspension was last noticed, or at first.
    known: Duration,
}

impl Default for Suspensions {
    /// By the clocks of the system.
    fn default() -> Self {
        Self::new(Box::new(suspended_so_far))
    }
}

impl Suspensions {
    pub(super) fn new(clock: SuspensionClock) -> Self {
        let known = clock();
        Self { clock, known }
    }

    /// For how long the computer was suspended since this was last asked; `None` if it was not.
    pub(super) fn since_last(&mut self) -> Option<Duration> {
        let now = (self.clock)();
        let suspended = now.saturating_sub(self.known);
        if suspended < SHORTEST {
            return None;
        }
        self.known = now;
        Some(suspended)
    }
}

/// `CLOCK_BOOTTIME` counts suspensions and `CLOCK_MONOTONIC` does not (clock_gettime(2)). The latter is read last: a delay
/// between the two makes the difference smaller, and no suspension is invented.
fn suspended_so_far() -> Duration {
    let since_boot = duration(clock_gettime(ClockId::Boottime));
    since_boot.saturating_sub(duration(clock_gettime(ClockId::Monotonic)))
}

fn duration(time: Timespec) -> Duration {
    Duration::try_from(time).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[test]
    fn each_suspension_is_noticed_once_and_differences_of_reading_are_not() {
        let suspended_ms = Arc::new(AtomicU64::new(7_000));
        let clock = Arc::clone(&suspended_ms);
        let mut suspensions = Suspensions::new(Box::new(move || {
            Duration::from_millis(clock.load(Ordering::Relaxed))
        }));
        assert_eq!(suspensions.since_last(), None);
        suspended_ms.store(7_900, Ordering::Relaxed);
        assert_eq!(suspensions.since_last(), None);
        suspended_ms.store(67_000, Ordering::Relaxed);
        assert_eq!(suspensions.since_last(), Some(Duration::from_secs(60)));
        assert_eq!(suspensions.since_last(), None);
    }

    #[test]
    fn the_clocks_of_the_system_tell_no_suspension_of_a_computer_that_runs() {
        let mut suspensions = Suspensions::default();
        for _ in 0..1000 {
            assert_eq!(suspensions.since_last(), None);
        }
    }
}
