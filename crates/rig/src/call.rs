//! What a scan asks of its devices, as something that can be written down and done again.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::device::Role;
use super::error::RigError;
use super::space::{Feed, RobotPosition};
use super::{ElementDelay, FocusArray, Motion, Reading, Receiver};
use fieldgap_input::Positive;

/// A call of a driver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Call {
    /// [`Motion::home`]
    Home,
    /// [`Motion::move_to`]
    MoveTo {
        /// Robot's axes, m.
        target_m: [f64; 3],
        /// mm/s.
        feed_mm_s: Positive,
    },
    /// [`Motion::stop`]
    Stop,
    /// [`Receiver::read_point`]
    ReadPoint {
        /// How long to settle.
        settle: Duration,
        /// Readings averaged.
        count: usize,
    },
    /// [`FocusArray::silence`]
    Silence,
    /// [`FocusArray::continuous_wave`]
    ContinuousWave,
    /// [`FocusArray::set_delays`]; a silent element has none.
    SetDelays(Vec<Option<f64>>),
    /// [`FocusArray::emit`]
    Emit,
    /// [`FocusArray::refresh`]
    Refresh,
    /// [`FocusArray::confirm`]
    Confirm {
        /// Whether it is to emit.
        emits: bool,
    },
}

/// What came of a call.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// It was done.
    Done,
    /// The robot stands there, robot's axes, m.
    Stands([f64; 3]),
    /// It was read.
    Read(Reading),
}

impl Call {
    /// A move.
    pub fn move_to(target: RobotPosition, feed: Feed) -> Self {
        Self::MoveTo { target_m: target.axes_m(), feed_mm_s: feed.mm_s() }
    }

    /// Delays for each element.
    pub fn set_delays(delays: &[ElementDelay]) -> Self {
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
    pub fn role(&self) -> Role {
        match self {
            Self::Home | Self::MoveTo { .. } | Self::Stop => Role::Robot,
            Self::ReadPoint { .. } => Role::Receiver,
            _ => Role::FocusArray,
        }
    }

    /// Does it.
    ///
    /// # Errors
    /// The device's.
    pub async fn perform(&self, devices: Devices<'_>) -> Result<Outcome, RigError> {
        let Devices { motion, receiver, array } = devices;
        let stands = |position: RobotPosition| Outcome::Stands(position.axes_m());
        match (self, motion, receiver, array) {
            (Self::Home, Some(robot), ..) => robot.home().await.map(stands),
            (Self::MoveTo { target_m, feed_mm_s }, Some(robot), ..) => {
                let target = RobotPosition::from_axes_m(*target_m);
                robot.move_to(target, Feed::from_mm_s(*feed_mm_s)).await.map(stands)
            }
            (Self::Stop, Some(robot), ..) => robot.stop().await.map(|()| Outcome::Done),
            (Self::ReadPoint { settle, count }, _, Some(receiver), _) => {
                receiver.read_point(*settle, *count).await.map(Outcome::Read)
            }
            (call, _, _, Some(array)) => call.perform_on(array).await.map(|()| Outcome::Done),
            _ => unreachable!("a call is performed on the device that it is for"),
        }
    }

    async fn perform_on(&self, array: &mut dyn FocusArray) -> Result<(), RigError> {
        match self {
            Self::ContinuousWave => array.continuous_wave().await,
            Self::SetDelays(delays_s) => {
                let delay = |seconds: &Option<f64>| {
                    seconds.map_or(ElementDelay::Silent, ElementDelay::Seconds)
                };
                let delays: Vec<ElementDelay> = delays_s.iter().map(delay).collect();
                array.set_delays(&delays).await
            }
            Self::Emit => array.emit().await,
            Self::Refresh => array.refresh().await,
            Self::Confirm { emits } => array.confirm(*emits).await,
            _ => array.silence().await,
        }
    }
}

impl Outcome {
    /// Where the robot stands; `None` of another call.
    pub fn position(&self) -> Option<RobotPosition> {
        match self {
            Self::Stands(axes_m) => Some(RobotPosition::from_axes_m(*axes_m)),
            _ => None,
        }
    }

    /// What was read; `None` of another call.
    pub fn reading(&self) -> Option<Reading> {
        match self {
            Self::Read(reading) => Some(*reading),
            _ => None,
        }
    }

    /// As it stands in a log.
    pub(super) fn in_words(outcome: &Result<Self, RigError>) -> String {
        match outcome {
            Ok(outcome) => {
                format!("ok {}", serde_json::to_string(outcome).expect("numbers are JSON"))
            }
            Err(error) => format!("error {error}"),
        }
    }
}

/// The device that a call is for.
#[derive(Default)]
pub struct Devices<'a> {
    motion: Option<&'a mut dyn Motion>,
    receiver: Option<&'a mut dyn Receiver>,
    array: Option<&'a mut dyn FocusArray>,
}

impl<'a> Devices<'a> {
    /// A robot.
    pub fn robot(robot: &'a mut dyn Motion) -> Self {
        Self { motion: Some(robot), ..Self::default() }
    }

    /// A receiver.
    pub fn receiver(receiver: &'a mut dyn Receiver) -> Self {
        Self { receiver: Some(receiver), ..Self::default() }
    }

    /// An array.
    pub fn array(array: &'a mut dyn FocusArray) -> Self {
        Self { array: Some(array), ..Self::default() }
    }
}
