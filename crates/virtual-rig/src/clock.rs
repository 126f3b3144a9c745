//! The virtual rig's time, shared by its three devices.

use std::sync::Mutex;
use std::time::Duration;

use serde::Deserialize;
use tokio::sync::Notify;
use tokio::time::Instant;

use fieldgap_input::Positive;

const NANOSECOND: Duration = Duration::from_nanos(1);

/// How virtual time passes.
///
/// In a rig file: `pace = "lockstep"` or `pace = { times = 20.0 }`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// Virtual time stands still until a device's answer needs it, and then jumps: to the end of the planned motion for
    /// `M400`, by `n / rate` for `n` readings. Waiting takes no wall time, and nothing depends on the computer's speed: the same
    /// commands give the same bytes.
    Lockstep,
    /// Virtual time is wall time multiplied by this factor. In a test with paused time it is the time of the test.
    Times(Positive),
}

/// Seconds of virtual time since the rig was powered up.
///
/// Readings, motion and time-outs all use this clock and no other.
#[derive(Debug)]
pub struct Clock {
    pace: Pace,
    powered_up: Instant,
    lockstep_now_s: Mutex<f64>,
    jumped: Notify,
}

impl Clock {
    /// A clock that starts now at zero.
    pub fn new(pace: Pace) -> Self {
        Self {
            pace,
            powered_up: Instant::now(),
            lockstep_now_s: Mutex::new(0.0),
            jumped: Notify::new(),
        }
    }

    /// Virtual seconds since power-up.
    pub fn now_s(&self) -> f64 {
        match self.pace {
            Pace::Lockstep => *self.lock(),
            Pace::Times(factor) => self.powered_up.elapsed().as_secs_f64() * factor.get(),
        }
    }

    /// Whether a device that needs time to pass may make it pass.
    pub fn is_lockstep(&self) -> bool {
        self.pace == Pace::Lockstep
    }

    /// Lockstep only: jumps to `time_s`. An earlier time than now changes nothing; at a pace of wall time the
    /// call has no effect.
    pub fn jump_to(&self, time_s: f64) {
        let mut now_s = self.lock();
        if time_s > *now_s {
            *now_s = time_s;
            drop(now_s);
            self.jumped.notify_waiters();
        }
    }

    /// Returns when virtual time has reached `time_s`: after the wall time that this takes, or in lockstep
    /// when some other device has jumped there.
    pub async fn reached(&self, time_s: f64) {
        loop {
            let jumped = self.jumped.notified();
            tokio::pin!(jumped);
            jumped.as_mut().enable();
            let remaining_s = time_s - self.now_s();
            if remaining_s <= 0.0 {
                return;
            }
            match self.pace {
                Pace::Lockstep => jumped.await,
                Pace::Times(factor) => {
                    let wall_s = (remaining_s / factor.get()).min(3600.0);
                    // What is below a nanosecond is rounded off, and would be waited for without end in paused time.
                    tokio::time::sleep(Duration::from_secs_f64(wall_s) + NANOSECOND).await;
                }
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, f64> {
        self.lockstep_now_s.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_lockstep_time_passes_only_by_jumps_and_never_backwards() {
        let clock = Clock::new(Pace::Lockstep);
        assert_eq!(clock.now_s(), 0.0);
        clock.jump_to(3.5);
        clock.jump_to(1.0);
        assert_eq!(clock.now_s(), 3.5);
    }

    #[tokio::test]
    async fn a_jump_wakes_whoever_waits_for_that_time() {
        let clock = std::sync::Arc::new(Clock::new(Pace::Lockstep));
        let waiting = tokio::spawn({
            let clock = clock.clone();
            async move { clock.reached(2.0).await }
        });
        tokio::task::yield_now().await;
        clock.jump_to(1.0);
        tokio::task::yield_now().await;
        assert!(!waiting.is_finished());
        clock.jump_to(2.0);
        waiting.await.expect("the waiting task ends");
    }

    #[test]
    fn at_a_pace_of_wall_time_jumps_do_nothing() {
        let clock = Clock::new(Pace::Times(Positive::new(1e-6).expect("positive")));
        clock.jump_to(100.0);
        assert!(clock.now_s() < 1.0);
    }
}
