//! The rule by which a slow computer is told from a lost program; its bounds are in the [module above](super).

use std::time::Duration;

use super::activity::Activity;
use super::{BEAT_LOST_AFTER, SLOW_AT_MOST};

/// How long the guard waits for a beat at a time.
pub(super) const STEP: Duration = Duration::from_millis(100);

/// How often in a row the silent thread must be seen asleep. It beats every 250 ms, so one look may fall just behind a beat
/// that came late, three looks over 300 ms may not.
const LOOKS: u32 = 3;

/// Why the program is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lost {
    /// It has ended.
    Gone,
    /// It was stopped.
    Stopped,
    /// Its beat stopped, and it does not wait for the computer.
    Still,
    /// Its beat stopped, and it has waited too long for the computer.
    Starved,
    /// It beats, but its work does not respond.
    Stuck,
}

impl Lost {
    /// What the program did, for a person.
    pub fn text(self) -> String {
        let (beat_s, slow_s) = (BEAT_LOST_AFTER.as_secs(), SLOW_AT_MOST.as_secs());
        match self {
            Self::Gone => "ended without closing the rig".to_owned(),
            Self::Stopped => format!("was stopped and has not responded for {beat_s} s"),
            Self::Still => format!("has not responded for {beat_s} s"),
            Self::Starved => format!(
                "has not responded for {slow_s} s: the computer gave it no processor, memory or disk"
            ),
            Self::Stuck => format!("has been stuck in its work for {slow_s} s"),
        }
    }
}

/// Counts the time since the last beat.
#[derive(Debug, Default)]
pub(super) struct Vigil {
    /// As the clock says.
    silent: Duration,
    /// Without the time in which the guard itself was held up.
    watched: Duration,
    seen_asleep: u32,
}

impl Vigil {
    /// A beat came; it says for how long the work has not responded.
    pub fn beat(&mut self, unresponsive: Duration) -> Option<Lost> {
        *self = Self::default();
        (unresponsive >= SLOW_AT_MOST).then_some(Lost::Stuck)
    }

    /// No beat came in a [`STEP`], which took so long. `activity` tells what the thread that beats does.
    pub fn quiet(&mut self, took: Duration, activity: impl FnOnce() -> Activity) -> Option<Lost> {
        self.silent += took;
        self.watched += took.min(2 * STEP);
        if self.watched < BEAT_LOST_AFTER {
            return None;
        }
        let activity = activity();
        self.seen_asleep = if activity == Activity::Asleep { self.seen_asleep + 1 } else { 0 };
        match activity {
            Activity::Ended => Some(Lost::Gone),
            Activity::Stopped => Some(Lost::Stopped),
            Activity::Asleep if self.seen_asleep >= LOOKS => Some(Lost::Still),
            _ => (self.silent >= SLOW_AT_MOST).then_some(Lost::Starved),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After how many steps of `took` a program that does `activity` is lost, and why; `None` if not within ten minutes.
    fn lost_after(took: Duration, activity: Activity) -> Option<(Duration, Lost)> {
        let mut vigil = Vigil::default();
        let mut silent = Duration::ZERO;
        while silent < Duration::from_secs(600) {
            silent += took;
            if let Some(lost) = vigil.quiet(took, || activity) {
                return Some((silent, lost));
            }
        }
        None
    }

    #[test]
    fn each_kind_of_loss_is_acted_on_within_its_time() {
        let s = Duration::from_secs_f64;
        assert_eq!(lost_after(STEP, Activity::Stopped), Some((s(2.0), Lost::Stopped)));
        assert_eq!(lost_after(STEP, Activity::Asleep), Some((s(2.2), Lost::Still)));
        assert_eq!(lost_after(STEP, Activity::Busy), Some((s(30.0), Lost::Starved)));
        assert_eq!(lost_after(STEP, Activity::Ended), Some((s(2.0), Lost::Gone)));
        assert_eq!(Vigil::default().beat(s(29.9)), None);
        assert_eq!(Vigil::default().beat(SLOW_AT_MOST), Some(Lost::Stuck));
    }

    #[test]
    fn a_guard_that_was_held_up_itself_does_not_count_that_time() {
        let mut vigil = Vigil::default();
        // One wait of 100 ms took 5 s: the computer was busy, and the beat may be on its way.
        assert_eq!(vigil.quiet(Duration::from_secs(5), || panic!("too early to look")), None);
        for _ in 0..17 {
            assert_eq!(vigil.quiet(STEP, || panic!("too early to look")), None);
        }
        assert_eq!(vigil.quiet(STEP, || Activity::Stopped), Some(Lost::Stopped));
    }

    #[test]
    fn a_starved_program_that_beats_again_is_kept() {
        let mut vigil = Vigil::default();
        for _ in 0..5 {
            for step in 0..200 {
                let seen = if step % 3 == 2 { Activity::Asleep } else { Activity::Busy };
                assert_eq!(vigil.quiet(STEP, || seen), None);
            }
            assert_eq!(vigil.beat(Duration::ZERO), None);
        }
    }
}
