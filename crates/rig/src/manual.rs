//! The devices of a rig that a person operates by hand. Other programs may use the others at the same time.

use std::fmt;

use super::config::RigConfig;
use super::emergency::Emergency;
use super::error::RigError;
use super::motion::observed::{Observed, RobotObserver};
use super::safety::{Ports, open_array, open_motion, silence, stop};
use super::{FocusArray, Motion, Receiver};

/// Which devices to open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DeviceSelection {
    /// The focus array.
    pub array: bool,
    /// The robot.
    pub robot: bool,
    /// The receiver.
    pub receiver: bool,
}

/// The open devices. Dropping it silences the array as far as that can be done without waiting.
pub struct ManualRig {
    // Dropped in this order.
    array: Option<Box<dyn FocusArray>>,
    robot: Option<Box<dyn Motion>>,
    receiver: Option<Box<dyn Receiver>>,
}

impl ManualRig {
    /// Opens the selected devices: the array first, which is silent from then on. Nothing moves.
    ///
    /// # Errors
    /// The first device that cannot be opened; those already open are left safe.
    pub async fn open(
        config: &RigConfig,
        ports: &Ports,
        wanted: DeviceSelection,
    ) -> Result<Self, RigError> {
        let array = match wanted.array {
            true => Some(open_array(config, ports).await?),
            false => None,
        };
        let receiver = match wanted.receiver {
            true => Some(config.receiver.open(ports.receiver.as_deref()).await?),
            false => None,
        };
        let robot = match wanted.robot {
            true => Some(open_motion(&config.motion, ports).await?),
            false => None,
        };
        Ok(Self { array, robot, receiver })
    }

    /// Puts devices together. The robot is guarded by the caller or by [`ManualRig::open`].
    pub fn new(
        array: Option<Box<dyn FocusArray>>,
        robot: Option<Box<dyn Motion>>,
        receiver: Option<Box<dyn Receiver>>,
    ) -> Self {
        Self { array, robot, receiver }
    }

    /// Lets `observer` follow the robot, if it was selected, from now on.
    pub fn observed_by(self, observer: Box<dyn RobotObserver>) -> Self {
        let observed = |robot| Box::new(Observed::new(robot, observer)) as Box<dyn Motion>;
        Self { robot: self.robot.map(observed), ..self }
    }

    /// The focus array.
    ///
    /// # Panics
    /// If it was not selected.
    pub fn array(&mut self) -> &mut dyn FocusArray {
        &mut **self.array.as_mut().expect("the array was selected")
    }

    /// The robot.
    ///
    /// # Panics
    /// If it was not selected.
    pub fn robot(&mut self) -> &mut dyn Motion {
        &mut **self.robot.as_mut().expect("the robot was selected")
    }

    /// The receiver.
    ///
    /// # Panics
    /// If it was not selected.
    pub fn receiver(&mut self) -> &mut dyn Receiver {
        &mut **self.receiver.as_mut().expect("the receiver was selected")
    }

    /// Robot and receiver at once, where both are there.
    pub fn robot_and_receiver(&mut self) -> (&mut dyn Motion, Option<&mut dyn Receiver>) {
        let robot = &mut **self.robot.as_mut().expect("the robot was selected");
        let receiver = self.receiver.as_mut().map(|receiver| &mut **receiver as &mut dyn Receiver);
        (robot, receiver)
    }

    /// Robot and array at once, so that the array can be silenced while the robot moves.
    ///
    /// # Panics
    /// If one of them was not selected.
    pub fn robot_and_array(&mut self) -> (&mut dyn Motion, &mut dyn FocusArray) {
        let robot = &mut **self.robot.as_mut().expect("the robot was selected");
        (robot, &mut **self.array.as_mut().expect("the array was selected"))
    }

    /// What a watchdog sends to the open devices if this program ends without closing them.
    pub fn emergencies(&self) -> Vec<Emergency> {
        let array = self.array.as_ref().and_then(|array| array.emergency());
        let robot = self.robot.as_ref().and_then(|robot| robot.emergency());
        [array, robot].into_iter().flatten().collect()
    }

    /// Silences the array and stops the robot, both at once, and reports what could not be done. The commands are sent
    /// immediately; the array's confirmation is awaited for half a second, the robot's for five seconds.
    ///
    /// May be called at any time, also when a call to a device was cancelled in its middle. The robot's position
    /// is unknown afterwards.
    pub async fn make_safe(&mut self, reason: impl Into<String>) -> ManualSafetyReport {
        let mut made = ManualSafetyReport { reason: reason.into(), array: None, robot: None };
        let array = self.array.as_mut();
        let robot = self.robot.as_mut();
        (made.array, made.robot) = tokio::join!(
            biased;
            async { Some(silence(&mut **array?).await) },
            async { Some(stop(&mut **robot?).await) },
        );
        tracing::warn!("{made}");
        made
    }
}

/// What was done to leave the open devices safe, and what could not be.
#[derive(Debug)]
pub struct ManualSafetyReport {
    /// Why.
    pub reason: String,
    /// Whether the array confirmed its silence; `None` where it was not open.
    pub array: Option<Result<(), RigError>>,
    /// Whether the robot confirmed its standstill; `None` where it was not open.
    pub robot: Option<Result<(), RigError>>,
}

impl ManualSafetyReport {
    /// Whether every open device confirmed.
    pub fn is_safe(&self) -> bool {
        [&self.array, &self.robot].into_iter().flatten().all(Result::is_ok)
    }
}

impl fmt::Display for ManualSafetyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let array = self.array.as_ref().map(|array| match array {
            Ok(()) => "the array is silent".to_owned(),
            Err(error) => format!("THE ARRAY MAY STILL EMIT ({error})"),
        });
        let robot = self.robot.as_ref().map(|robot| match robot {
            Ok(()) => "the robot stands still".to_owned(),
            Err(error) => format!("THE ROBOT MAY STILL MOVE ({error})"),
        });
        let done: Vec<String> = [array, robot].into_iter().flatten().collect();
        write!(f, "{}", self.reason)?;
        if done.is_empty() { Ok(()) } else { write!(f, ": {}", done.join(", ")) }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::device::{Device, Role};
    use crate::error::Cause;

    #[test]
    fn only_open_devices_are_reported() {
        let made = |array, robot| ManualSafetyReport { reason: "interrupted".into(), array, robot };
        assert_eq!(made(None, None).to_string(), "interrupted");
        assert_eq!(made(None, Some(Ok(()))).to_string(), "interrupted: the robot stands still");
        let array = Device::new(Role::FocusArray, "/dev/ttyUSB2");
        let silent = Cause::Silent { waited: Duration::from_millis(500) };
        let lost = RigError::new(array, "silencing the array", silent, None);
        let made = made(Some(Err(lost)), Some(Ok(())));
        assert!(!made.is_safe());
        assert_eq!(
            made.to_string(),
            "interrupted: THE ARRAY MAY STILL EMIT (focus array on /dev/ttyUSB2, silencing the array: no \
             answer within 0.5 s), the robot stands still"
        );
    }

    #[tokio::test]
    async fn nothing_open_is_safe_at_once() {
        let mut nothing = ManualRig::new(None, None, None);
        assert!(nothing.make_safe("done").await.is_safe());
    }
}
