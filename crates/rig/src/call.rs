//! The calls that a scan makes of its devices, and their outcomes, as the wire log records them and a replay repeats them.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::device::Role;
use super::error::RigError;
use super::space::{Feed, RobotPosition};
use super::{ElementDelay, Reading};
use fieldgap_input::Positive;

/// A call of a driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Call {
    /// [`Motion::home`](crate::Motion::home)
    Home,
    /// [`Motion::move_to`](crate::Motion::move_to)
    MoveTo {
        /// Robot's axes, m.
        target_m: [f64; 3],
        /// mm/s.
        feed_mm_s: Positive,
    },
    /// [`Motion::stop`](crate::Motion::stop)
    Stop,
    /// [`Motion::position`](crate::Motion::position)
    Position,
    /// [`Receiver::read_point`](crate::Receiver::read_point)
    ReadPoint {
        /// How long to settle.
        settle: Duration,
        /// Readings averaged.
        count: usize,
    },
    /// [`FocusArray::silence`](crate::FocusArray::silence)
    Silence,
    /// [`FocusArray::continuous_wave`](crate::FocusArray::continuous_wave)
    ContinuousWave,
    /// [`FocusArray::set_delays`](crate::FocusArray::set_delays); a silent element has none.
    SetDelays(Vec<Option<f64>>),
    /// [`FocusArray::emit`](crate::FocusArray::emit)
    Emit,
    /// [`FocusArray::refresh`](crate::FocusArray::refresh)
    Refresh,
    /// [`FocusArray::confirm`](crate::FocusArray::confirm)
    Confirm {
        /// Whether it is to emit.
        emits: bool,
    },
}

/// The outcome of a call.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum CallOutcome {
    /// It was done.
    Done,
    /// The robot stands there, robot's axes, m.
    Stands([f64; 3]),
    /// It was read.
    Read(Reading),
}

/// Longest settling and most readings of a call of a log.
const LONGEST: Duration = Duration::from_secs(1_000_000);
const MOST_READINGS: usize = 10_000_000;

impl Call {
    /// Whether a program can have made the call; a log may be damaged.
    pub(super) fn can_be(&self) -> bool {
        match self {
            Self::ReadPoint { settle, count } => *settle <= LONGEST && *count <= MOST_READINGS,
            _ => true,
        }
    }

    /// A move.
    pub(super) fn move_to(target: RobotPosition, feed: Feed) -> Self {
        Self::MoveTo { target_m: target.axes_m(), feed_mm_s: feed.mm_s() }
    }

    /// Delays for each element.
    pub(super) fn set_delays(delays: &[ElementDelay]) -> Self {
        let seconds = |delay: &ElementDelay| match delay {
            ElementDelay::Seconds(seconds) => Some(*seconds),
            ElementDelay::Silent => None,
        };
        Self::SetDelays(delays.iter().map(seconds).collect())
    }

    /// As a line of JSON.
    pub(super) fn encode(&self) -> String {
        serde_json::to_string(self).expect("numbers are JSON")
    }

    /// The device that is called.
    pub(super) fn role(&self) -> Role {
        match self {
            Self::Home | Self::MoveTo { .. } | Self::Stop | Self::Position => Role::Robot,
            Self::ReadPoint { .. } => Role::Receiver,
            _ => Role::FocusArray,
        }
    }
}

impl From<()> for CallOutcome {
    fn from((): ()) -> Self {
        Self::Done
    }
}

impl From<RobotPosition> for CallOutcome {
    fn from(position: RobotPosition) -> Self {
        Self::Stands(position.axes_m())
    }
}

impl From<Reading> for CallOutcome {
    fn from(reading: Reading) -> Self {
        Self::Read(reading)
    }
}

/// The result of a call, as a log records it.
pub(super) fn result_text<T: Into<CallOutcome> + Clone>(result: &Result<T, RigError>) -> String {
    match result {
        Ok(value) => {
            let outcome: CallOutcome = value.clone().into();
            format!("ok {}", serde_json::to_string(&outcome).expect("numbers are JSON"))
        }
        Err(error) => format!("error {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Logs recorded earlier must still be read, so these lines must not change.
    #[test]
    fn calls_and_outcomes_keep_their_format_in_the_log() {
        let feed = Feed::from_mm_s(Positive::new(80.0).expect("positive"));
        let delays = [ElementDelay::Seconds(5e-6), ElementDelay::Silent];
        for (call, line) in [
            (Call::Home, r#""home""#),
            (
                Call::move_to(RobotPosition::from_axes_m([0.5, 0.25, 0.0]), feed),
                r#"{"move-to":{"target_m":[0.5,0.25,0.0],"feed_mm_s":80.0}}"#,
            ),
            (
                Call::ReadPoint { settle: Duration::from_millis(20), count: 16 },
                r#"{"read-point":{"settle":{"secs":0,"nanos":20000000},"count":16}}"#,
            ),
            (Call::set_delays(&delays), r#"{"set-delays":[5e-6,null]}"#),
            (Call::Confirm { emits: true }, r#"{"confirm":{"emits":true}}"#),
        ] {
            assert_eq!(call.encode(), line);
            assert_eq!(serde_json::from_str::<Call>(line).expect("a call"), call);
        }
        assert_eq!(result_text(&Ok(())), r#"ok "done""#);
        let stands = RobotPosition::from_axes_m([0.5, 0.25, 0.0]);
        assert_eq!(result_text(&Ok(stands)), r#"ok {"stands":[0.5,0.25,0.0]}"#);
    }
}
