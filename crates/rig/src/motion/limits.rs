//! How long robots may take.

use std::time::Duration;

/// How long a stop may take to be confirmed. Motion itself ends within milliseconds; but Marlin discards its queue for one or
/// two seconds after `M410` before it answers, and may have to be asked twice.
pub(crate) const STOPPED_WITHIN: Duration = Duration::from_secs(5);

/// How long a move may take at most, and where its start or its speed is not known.
pub(super) const LONGEST_MOVE: Duration = Duration::from_secs(600);

/// How much longer than it should a move may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slack {
    /// Times its expected length...
    pub(super) factor: f64,
    /// ... and this much more.
    pub(super) extra: Duration,
}

impl Slack {
    /// How long a move may take that should take `expected_s`, where that is known.
    pub(super) fn longest(self, expected_s: Option<f64>) -> Duration {
        expected_s
            .and_then(|seconds| Duration::try_from_secs_f64(self.factor * seconds).ok())
            .map_or(LONGEST_MOVE, |moving| moving.saturating_add(self.extra).min(LONGEST_MOVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_may_take_a_multiple_of_its_time_and_never_longer_than_the_limit() {
        let slack = Slack { factor: 2.0, extra: Duration::from_secs(10) };
        assert_eq!(slack.longest(Some(3.0)), Duration::from_secs(16));
        for unknown in [None, Some(1e6), Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(slack.longest(unknown), LONGEST_MOVE);
        }
    }
}
