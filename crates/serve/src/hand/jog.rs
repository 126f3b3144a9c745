//! A jog: the robot moves while a key or button is held, in short moves that are each checked.
//!
//! Only one short move is ever under way. When the heartbeats of the page end, for whatever reason, no further move begins, and the robot
//! stands at a known place. A stop in the middle of a move would lose the place, so a release does not stop it.

use std::time::{Duration, Instant};

use fieldgap_acoustics::Vec3;

use super::Axis;

/// A jog ends if no heartbeat arrives for so long.
pub const HEARTBEAT_WITHIN: Duration = Duration::from_millis(250);

/// Length of one move, s of travel: the robot has stopped at most this long after the last heartbeat has run out.
const MOVE_S: f64 = 0.1;

/// A jog that is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jog {
    hold: u64,
    direction: Vec3,
    speed_m_s: f64,
    last: Instant,
}

/// The jog that is held, and the last one that was released: a heartbeat that was overtaken by its release starts nothing.
#[derive(Debug, Default)]
pub(super) struct Jogging {
    held: Option<Jog>,
    released: Option<u64>,
}

impl Axis {
    /// Its unit vector.
    pub(super) fn unit(self) -> Vec3 {
        match self {
            Self::X => Vec3::new(1.0, 0.0, 0.0),
            Self::Y => Vec3::new(0.0, 1.0, 0.0),
            Self::Z => Vec3::new(0.0, 0.0, 1.0),
        }
    }
}

impl Jogging {
    /// A heartbeat; the sign of the speed is the direction. Whether it begins a jog.
    pub fn beat(&mut self, hold: u64, axis: Axis, speed_mm_s: f64, now: Instant) -> bool {
        if self.released.is_some_and(|released| hold <= released) {
            return false;
        }
        let begins = self.held.is_none_or(|jog| jog.hold != hold);
        let (direction, speed_m_s) = (axis.unit() * speed_mm_s.signum(), speed_mm_s.abs() * 1e-3);
        self.held = Some(Jog { hold, direction, speed_m_s, last: now });
        begins
    }

    /// Ends the jog with this number.
    pub fn release(&mut self, hold: u64) {
        self.released = self.released.max(Some(hold));
        if self.held.is_some_and(|jog| jog.hold <= hold) {
            self.held = None;
        }
    }

    /// Ends whatever jog is held. It takes a new hold to move again.
    pub fn end(&mut self) {
        if let Some(jog) = self.held {
            self.release(jog.hold);
        }
    }

    /// The next short move, m, and its speed, m/s; `None` if no jog is held or its heartbeats have run out.
    pub fn next_move(&mut self, now: Instant) -> Option<(Vec3, f64)> {
        let jog = self.held?;
        if now.saturating_duration_since(jog.last) > HEARTBEAT_WITHIN {
            self.end();
            return None;
        }
        Some((jog.direction * (jog.speed_m_s * MOVE_S), jog.speed_m_s))
    }

    /// Whether a jog is held.
    pub fn is_held(&self) -> bool {
        self.held.is_some()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_jog_moves_while_heartbeats_arrive() {
        let (mut jogging, now) = (Jogging::default(), Instant::now());
        assert!(jogging.beat(1, Axis::X, -20.0, now));
        assert!(!jogging.beat(1, Axis::X, -20.0, now + HEARTBEAT_WITHIN / 2));
        let (by, speed_m_s) = jogging.next_move(now + HEARTBEAT_WITHIN).expect("it is held");
        assert_eq!((by, speed_m_s), (Vec3::new(-0.002, 0.0, 0.0), 0.02));
        assert_eq!(jogging.next_move(now + HEARTBEAT_WITHIN * 2), None);
        assert!(
            !jogging.beat(1, Axis::X, -20.0, now + HEARTBEAT_WITHIN * 2),
            "a late heartbeat starts nothing"
        );
        assert_eq!(jogging.next_move(now + HEARTBEAT_WITHIN * 2), None);
        assert!(jogging.beat(2, Axis::Z, 5.0, now + HEARTBEAT_WITHIN * 2));
    }

    proptest! {
        /// Whatever arrives in whatever order, nothing moves after the release or a quarter of a second of silence.
        #[test]
        fn nothing_moves_unheld(acts in prop::collection::vec((any::<bool>(), 1..5u64, 0..400u64), 1..50)) {
            let mut jogging = Jogging::default();
            let mut now = Instant::now();
            for (beats, hold, later_ms) in acts {
                now += Duration::from_millis(later_ms);
                if beats {
                    jogging.beat(hold, Axis::Y, 1.0, now);
                } else {
                    jogging.release(hold);
                    prop_assert!(jogging.held.is_none_or(|jog| jog.hold > hold));
                }
                let last = jogging.held.map(|jog| jog.last);
                let moves = jogging.next_move(now + HEARTBEAT_WITHIN).is_some();
                prop_assert_eq!(moves, last == Some(now));
            }
        }
    }
}
