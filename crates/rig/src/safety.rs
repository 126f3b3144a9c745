//! The whole rig, and how it is left: the array silent, the robot still.

use std::fmt;
use std::time::Duration;

use tokio::time::timeout;

use super::call::{Call, CallOutcome, result_text};
use super::config::{MotionConfig, RigConfig};
use super::device::{Device, Role};
use super::error::{Cause, RigError};
use super::link::WireLogs;
use super::motion::guarded::Guarded;
use super::motion::limits::STOPPED_WITHIN;
use super::motion::observed::{Observed, RobotObserver};
use super::watchdog::once_released;
use super::{
    AirSensor, ElementDelay, Emergency, Feed, FocusArray, Motion, Reading, Receiver, Recording,
    RobotPosition,
};

/// How long the array may take to confirm its silence.
const SILENT_WITHIN: Duration = Duration::from_millis(500);

/// Ports that go before those of the rig file: a virtual rig's, or a person's choice on the command line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ports {
    /// The robot's.
    pub motion: Option<String>,
    /// The receiver's.
    pub receiver: Option<String>,
    /// The focus array's.
    pub focus_array: Option<String>,
    /// The environment sensor's.
    pub environment: Option<String>,
}

/// Opens the environment sensor, where the rig file has one.
///
/// # Errors
/// That it cannot be opened.
pub async fn open_air_sensor(
    config: &RigConfig,
    ports: &Ports,
) -> Result<Option<Box<dyn AirSensor>>, RigError> {
    match &config.environment {
        Some(environment) => Ok(Some(environment.open(ports.environment.as_deref()).await?)),
        None => Ok(None),
    }
}

/// Opens the three devices: the array first, which is silent from then on. Nothing moves. A port that the watchdog of a killed
/// program still makes safe is waited for, 15 s at most.
///
/// # Errors
/// The first device that cannot be opened; those already open are left safe.
pub async fn open(config: &RigConfig, ports: &Ports) -> Result<SafeRig, RigError> {
    let array = open_array(config, ports).await?;
    let receiver = config.receiver.open(ports.receiver.as_deref()).await?;
    let motion = open_motion(&config.motion, ports).await?;
    Ok(SafeRig::new(motion, receiver, array))
}

/// Opens the focus array alone, which is silent from then on.
///
/// # Errors
/// That it cannot be opened.
pub async fn open_array(
    config: &RigConfig,
    ports: &Ports,
) -> Result<Box<dyn FocusArray>, RigError> {
    once_released(async || config.focus_array.open(ports.focus_array.as_deref()).await).await
}

/// Opens the robot, behind its guard.
pub(super) async fn open_motion(
    config: &MotionConfig,
    ports: &Ports,
) -> Result<Box<dyn Motion>, RigError> {
    let robot = once_released(async || config.open(ports.motion.as_deref()).await).await?;
    Ok(Box::new(Guarded::new(robot, config.envelope(), config.position_tolerance_m())))
}

/// The three devices of a rig, owned together so that they can be made safe together.
///
/// Dropping it silences the array as far as that can be done without waiting.
pub struct SafeRig {
    // Dropped in this order.
    array: Box<dyn FocusArray>,
    motion: Box<dyn Motion>,
    receiver: Box<dyn Receiver>,
    logs: Option<WireLogs>,
}

impl SafeRig {
    /// Puts devices together. The robot is guarded by the caller or by [`open`].
    pub fn new(
        motion: Box<dyn Motion>,
        receiver: Box<dyn Receiver>,
        array: Box<dyn FocusArray>,
    ) -> Self {
        Self { array, motion, receiver, logs: None }
    }

    /// Lets `observer` follow the robot from now on.
    pub fn observed_by(self, observer: Box<dyn RobotObserver>) -> Self {
        Self { motion: Box::new(Observed::new(self.motion, observer)), ..self }
    }

    /// Records calls of the devices in the logs of their wires, from now on.
    pub fn recording_calls(self, logs: WireLogs) -> Self {
        Self { logs: Some(logs), ..self }
    }

    /// [`Motion::home`], recorded in the wire log.
    ///
    /// # Errors
    /// The robot's.
    pub async fn home(&mut self) -> Result<RobotPosition, RigError> {
        recorded(self.logs.as_ref(), &Call::Home, self.motion.home()).await
    }

    /// [`Motion::move_to`], recorded in the wire log.
    ///
    /// # Errors
    /// The robot's.
    pub async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        let moving = self.motion.move_to(target, feed);
        recorded(self.logs.as_ref(), &Call::move_to(target, feed), moving).await
    }

    /// [`Receiver::read_point`], recorded in the wire log.
    ///
    /// # Errors
    /// The receiver's.
    pub async fn read_point(
        &mut self,
        settle: Duration,
        count: usize,
    ) -> Result<Reading, RigError> {
        let reading = self.receiver.read_point(settle, count);
        recorded(self.logs.as_ref(), &Call::ReadPoint { settle, count }, reading).await
    }

    /// [`FocusArray::silence`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn silence(&mut self) -> Result<(), RigError> {
        recorded(self.logs.as_ref(), &Call::Silence, self.array.silence()).await
    }

    /// [`FocusArray::continuous_wave`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn continuous_wave(&mut self) -> Result<(), RigError> {
        recorded(self.logs.as_ref(), &Call::ContinuousWave, self.array.continuous_wave()).await
    }

    /// [`FocusArray::set_delays`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError> {
        let setting = self.array.set_delays(delays);
        recorded(self.logs.as_ref(), &Call::set_delays(delays), setting).await
    }

    /// [`FocusArray::emit`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn emit(&mut self) -> Result<(), RigError> {
        recorded(self.logs.as_ref(), &Call::Emit, self.array.emit()).await
    }

    /// [`FocusArray::refresh`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn refresh(&mut self) -> Result<(), RigError> {
        recorded(self.logs.as_ref(), &Call::Refresh, self.array.refresh()).await
    }

    /// [`FocusArray::confirm`], recorded in the wire log.
    ///
    /// # Errors
    /// The array's.
    pub async fn confirm(&mut self, emits: bool) -> Result<(), RigError> {
        recorded(self.logs.as_ref(), &Call::Confirm { emits }, self.array.confirm(emits)).await
    }

    /// [`Motion::confirm_place`]
    ///
    /// # Errors
    /// The robot's; it stands elsewhere, or was not homed.
    pub async fn confirm_place(&mut self) -> Result<RobotPosition, RigError> {
        if let Some(logs) = &self.logs {
            logs.note(Role::Robot, '~', "the place is confirmed");
        }
        self.motion.confirm_place().await
    }

    /// The robot.
    pub fn motion(&mut self) -> &mut dyn Motion {
        &mut *self.motion
    }

    /// The receiver.
    pub fn receiver(&mut self) -> &mut dyn Receiver {
        &mut *self.receiver
    }

    /// Moves straight to `target` while the receiver records. Returns the reported position and the recording.
    ///
    /// # Errors
    /// The robot's, or else the receiver's.
    pub async fn move_while_recording(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<(RobotPosition, Recording), RigError> {
        let logs = self.logs.as_ref();
        record_call(logs, &Call::move_to(target, feed));
        if let Some(logs) = logs {
            // The length of the recording depends on the robot, so a replay cannot repeat what follows.
            logs.note(Role::Receiver, '~', "a row is flown");
        }
        let mut arrived = None;
        let motion = &mut *self.motion;
        let moving = async { arrived = Some(motion.move_to(target, feed).await) };
        let recording = self.receiver.record(Box::pin(moving)).await;
        if let (Some(logs), Some(arrived)) = (logs, &arrived) {
            logs.note(Role::Robot, ':', &result_text(arrived));
        }
        let arrived = arrived.transpose()?;
        Ok((arrived.unwrap_or(target), recording?))
    }

    /// The focus array.
    pub fn array(&mut self) -> &mut dyn FocusArray {
        &mut *self.array
    }

    /// What another process sends to make the rig safe if this one ends; the array first.
    pub fn emergencies(&self) -> Vec<Emergency> {
        [self.array.emergency(), self.motion.emergency()].into_iter().flatten().collect()
    }

    /// Silences the array and stops the robot, both at once, and reports what could not be done. The commands are sent
    /// immediately; the array's confirmation is awaited for half a second, the robot's for five seconds.
    ///
    /// May be called at any time, also when a call to a device was cancelled in its middle. The robot's position
    /// is unknown afterwards.
    pub async fn make_safe(&mut self, reason: impl Into<String>) -> SafetyReport {
        for call in [Call::Silence, Call::Stop] {
            record_call(self.logs.as_ref(), &call);
        }
        let (array, robot) =
            tokio::join!(biased; silence(&mut *self.array), stop(&mut *self.motion));
        let report = SafetyReport { reason: reason.into(), array, robot };
        tracing::warn!("{report}");
        report
    }
}

/// Makes a call, and records it and its outcome in the log of the device's wire.
pub(crate) async fn recorded<T: Into<CallOutcome> + Clone>(
    logs: Option<&WireLogs>,
    call: &Call,
    calling: impl Future<Output = Result<T, RigError>>,
) -> Result<T, RigError> {
    record_call(logs, call);
    let result = calling.await;
    if let Some(logs) = logs {
        logs.note(call.role(), ':', &result_text(&result));
    }
    result
}

fn record_call(logs: Option<&WireLogs>, call: &Call) {
    if let Some(logs) = logs {
        logs.note(call.role(), '=', &call.encode());
    }
}

/// Silences the array, and waits for its confirmation no longer than half a second.
pub(crate) async fn silence(array: &mut dyn FocusArray) -> Result<(), RigError> {
    match timeout(SILENT_WITHIN, array.silence()).await {
        Ok(silenced) => silenced,
        Err(_) => Err(unconfirmed(array.device(), "silencing the array", SILENT_WITHIN)),
    }
}

/// Stops the robot, and waits for its confirmation no longer than a stop may take.
pub(crate) async fn stop(robot: &mut dyn Motion) -> Result<(), RigError> {
    match timeout(STOPPED_WITHIN, robot.stop()).await {
        Ok(stopped) => stopped,
        Err(_) => Err(unconfirmed(robot.device(), "stopping the robot", STOPPED_WITHIN)),
    }
}

fn unconfirmed(device: &Device, attempt: &str, waited: Duration) -> RigError {
    RigError::new(device.clone(), attempt, Cause::Silent { waited }, None)
}

/// What was done to leave the rig safe, and what could not be.
#[derive(Debug)]
pub struct SafetyReport {
    /// Why the rig was made safe.
    pub reason: String,
    /// Whether the array confirmed its silence.
    pub array: Result<(), RigError>,
    /// Whether the robot confirmed its standstill.
    pub robot: Result<(), RigError>,
}

impl SafetyReport {
    /// Whether both were confirmed.
    pub fn is_safe(&self) -> bool {
        self.array.is_ok() && self.robot.is_ok()
    }
}

impl fmt::Display for SafetyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.reason)?;
        match &self.array {
            Ok(()) => write!(f, "the array is silent, ")?,
            Err(error) => write!(f, "THE ARRAY MAY STILL EMIT ({error}), ")?,
        }
        match &self.robot {
            Ok(()) => write!(f, "the robot stands still"),
            Err(error) => write!(f, "THE ROBOT MAY STILL MOVE ({error})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use async_trait::async_trait;
    use tokio::time::Instant;

    use super::*;
    use crate::device::Role;
    use crate::{ArrayIdentity, ReceiverIdentity};

    type Log = Arc<Mutex<Vec<&'static str>>>;

    /// Stands for any device: notes what it is asked, and answers at once or never.
    struct Double {
        device: Device,
        log: Log,
        answers: bool,
    }

    impl Double {
        async fn asked(&self, what: &'static str) -> Result<(), RigError> {
            self.log.lock().expect("not poisoned").push(what);
            if !self.answers {
                std::future::pending::<()>().await;
            }
            Ok(())
        }
    }

    #[async_trait]
    impl Motion for Double {
        fn device(&self) -> &Device {
            &self.device
        }
        fn firmware(&self) -> &str {
            "double"
        }
        async fn home(&mut self) -> Result<RobotPosition, RigError> {
            unreachable!("making safe only silences and stops")
        }
        async fn move_to(&mut self, _: RobotPosition, _: Feed) -> Result<RobotPosition, RigError> {
            unreachable!("making safe only silences and stops")
        }
        async fn position(&mut self) -> Result<RobotPosition, RigError> {
            unreachable!("making safe only silences and stops")
        }
        async fn stop(&mut self) -> Result<(), RigError> {
            self.asked("stop").await
        }
        fn emergency(&self) -> Option<Emergency> {
            None
        }
    }

    #[async_trait]
    impl Receiver for Double {
        fn device(&self) -> &Device {
            &self.device
        }
        fn identity(&self) -> &ReceiverIdentity {
            unreachable!("making safe only silences and stops")
        }
        async fn read_point(&mut self, _: Duration, _: usize) -> Result<Reading, RigError> {
            unreachable!("making safe only silences and stops")
        }
    }

    #[async_trait]
    impl FocusArray for Double {
        fn device(&self) -> &Device {
            &self.device
        }
        fn identity(&self) -> &ArrayIdentity {
            unreachable!("making safe only silences and stops")
        }
        async fn silence(&mut self) -> Result<(), RigError> {
            self.asked("silence").await
        }
        fn emergency(&self) -> Option<Emergency> {
            None
        }
        async fn set_delays(&mut self, _: &[ElementDelay]) -> Result<(), RigError> {
            unreachable!("making safe only silences and stops")
        }
        async fn continuous_wave(&mut self) -> Result<(), RigError> {
            unreachable!("making safe does not change the modulation")
        }
        async fn emit(&mut self) -> Result<(), RigError> {
            unreachable!("making safe only silences and stops")
        }
    }

    fn rig(array_answers: bool, robot_answers: bool) -> (SafeRig, Log) {
        let log = Log::default();
        let double = |role, answers| {
            Box::new(Double { device: Device::new(role, "memory"), log: Arc::clone(&log), answers })
        };
        let rig = SafeRig::new(
            double(Role::Robot, robot_answers),
            double(Role::Receiver, true),
            double(Role::FocusArray, array_answers),
        );
        (rig, log)
    }

    #[tokio::test(start_paused = true)]
    async fn the_array_is_silenced_before_the_robot_is_stopped() {
        let (mut rig, log) = rig(true, true);
        let report = rig.make_safe("interrupted").await;
        assert!(report.is_safe());
        assert_eq!(*log.lock().expect("not poisoned"), ["silence", "stop"]);
        assert_eq!(report.to_string(), "interrupted: the array is silent, the robot stands still");
    }

    #[tokio::test(start_paused = true)]
    async fn a_dead_array_does_not_keep_the_robot_from_being_stopped_in_time() {
        let (mut rig, log) = rig(false, true);
        let start = Instant::now();
        let report = rig.make_safe("the receiver was lost").await;
        assert!(start.elapsed() <= SILENT_WITHIN);
        assert_eq!(*log.lock().expect("not poisoned"), ["silence", "stop"]);
        assert!(report.array.is_err() && report.robot.is_ok());
        assert!(
            report.to_string().contains("THE ARRAY MAY STILL EMIT (focus array on memory"),
            "{report}"
        );
    }

    #[tokio::test(start_paused = true)]
    async fn dead_devices_are_reported_in_time() {
        let (mut rig, _) = rig(false, false);
        let start = Instant::now();
        let report = rig.make_safe("everything was lost").await;
        assert!(start.elapsed() <= STOPPED_WITHIN && !report.is_safe());
        assert!(report.to_string().contains("THE ROBOT MAY STILL MOVE"), "{report}");
    }
}
