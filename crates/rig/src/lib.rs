//! Drivers for the devices of a scan: robots, receivers, phased arrays and air sensors.
//!
//! Use it to move a robot within its limits, to read a receiver or to drive an array from a program of your own. It
//! contains no acoustics: it takes delays and returns readings.
//!
//! # Where to begin
//!
//! - [`RigConfig`] holds the sections of a rig file; [`open`] opens the devices that it names.
//! - [`SafeRig`] owns an open robot, receiver and array. [`SafeRig::make_safe`] silences the array and stops the robot.
//!   [`ManualRig`] owns only those devices that a person operates.
//! - [`Motion`], [`Receiver`], [`FocusArray`] and [`AirSensor`] are the traits of the drivers. To write one, start from
//!   `examples/write_a_driver.rs`. The drivers of this crate are registered in [`config`].
//! - [`link::Wire`] carries lines and bytes over a serial port, a socket or a pipe in memory, with a limit on every wait.
//! - [`RigError`] names the device, the attempt, what was seen, and what to do.
//!
//! # Example
//!
//! Read a section of a rig file, and check paths against travel and keep-out boxes. No device is needed.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_rig::{MotionConfig, RobotPosition};
//!
//! #[derive(serde::Deserialize)]
//! struct RigFile {
//!     motion: MotionConfig,
//! }
//!
//! let text = r#"
//!     [motion]
//!     origin_mm = [150.0, 150.0, -20.0]
//!     travel_mm = { x = [0.0, 300.0], y = [0.0, 300.0], z = [0.0, 250.0] }
//!     feed_mm_s = 80.0
//!     position_tolerance_mm = 0.05
//!     keep_out = [{ name = "array", min_mm = [100.0, 100.0, 0.0], max_mm = [200.0, 200.0, 50.0] }]
//!     [motion.grbl]
//!     port = "/dev/ttyUSB0"
//! "#;
//! let file: RigFile = fieldgap_input::toml_text(Path::new("rig.toml"), text)?;
//! let envelope = file.motion.envelope();
//!
//! let left = RobotPosition::from_axes_mm([50.0, 150.0, 20.0]);
//! let right = RobotPosition::from_axes_mm([250.0, 150.0, 20.0]);
//! let fault = envelope.check_path(left, right).expect_err("the array is between them");
//! assert!(fault.to_string().contains("keep-out box `array`"));
//!
//! let [up, down] = [left, right].map(|position| RobotPosition { z_m: 0.06, ..position });
//! assert!(envelope.check_path(up, down).is_ok());
//! # Ok::<(), fieldgap_input::Fault>(())
//! ```

pub mod air_sensor;
mod call;
pub mod check;
pub mod config;
mod device;
mod emergency;
mod error;
pub mod focus_array;
mod key_value;
pub mod link;
mod manual;
pub mod motion;
pub mod receiver;
pub mod replay;
mod safety;
mod space;
pub mod travel;
pub mod watchdog;

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

pub use air_sensor::AirReading;
pub use config::{EnvironmentConfig, FocusArrayConfig, MotionConfig, ReceiverConfig, RigConfig};
pub use device::{Device, Role};
pub use emergency::{Emergency, SpareHandle};
pub use error::{Cause, RigError};
pub use focus_array::{ArrayIdentity, DriveProgram, ElementDelay, Sensed};
pub use manual::{DeviceSelection, ManualRig, ManualSafetyReport};
pub use motion::Advice;
pub use motion::observed::RobotObserver;
pub use receiver::{DuringRecording, Reading, ReceiverIdentity, Recording, TimedSample};
pub use safety::{Ports, SafeRig, SafetyReport, open, open_air_sensor, open_array};
pub use space::{Feed, Frame, RobotPosition};
pub use travel::{Envelope, PathFault};

/// A robot that carries the receiver along straight paths.
#[async_trait]
pub trait Motion: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// The firmware's name, as it was read when the device was opened.
    fn firmware(&self) -> &str;

    /// Settings of the device that reduce the quality or safety of scans, and what to do about them.
    fn advice(&self) -> &[Advice] {
        &[]
    }

    /// Finds the origin of the robot's axes by its end switches and returns where it then stands.
    ///
    /// Must be done before the first move, and again after a stop, a reset or any failed move.
    async fn home(&mut self) -> Result<RobotPosition, RigError>;

    /// Moves straight to `target` and returns the reported position once the robot stands still.
    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError>;

    /// The reported position. Also answers before homing, when the position is not yet defined.
    async fn position(&mut self) -> Result<RobotPosition, RigError>;

    /// How long the driver waits between two queries of the position, so as not to burden the firmware.
    fn query_pause(&self) -> Duration {
        Duration::ZERO
    }

    /// Confirms that it still reports the position of its last move, within its tolerance; that position.
    async fn confirm_place(&mut self) -> Result<RobotPosition, RigError> {
        self.position().await
    }

    /// Stops at once. The position is unknown afterwards.
    async fn stop(&mut self) -> Result<(), RigError>;

    /// What another process sends to stop the robot if this one ends: `self.wire.emergency(bytes)`.
    fn emergency(&self) -> Option<Emergency>;
}

/// A receiver whose reading is the magnitude of the field where it stands.
#[async_trait]
pub trait Receiver: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// Rate, range and unit, as the receiver states them.
    fn identity(&self) -> &ReceiverIdentity;

    /// Waits `settle` on the receiver's own clock, counted from now, and averages the `count` readings
    /// that follow. No reading is from before the call.
    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError>;

    /// Samples without a pause while `during` runs, which starts once the receiver is sampling.
    ///
    /// If recording fails or is cancelled, `during` is dropped unfinished.
    async fn record(&mut self, _during: DuringRecording<'_>) -> Result<Recording, RigError> {
        Err(unable(self.device(), "recording", Cause::NoRecording))
    }
}

/// A sensor of the air.
#[async_trait]
pub trait AirSensor: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// The newest reading.
    async fn air(&mut self) -> Result<AirReading, RigError>;
}

/// A phased array with a delay for each element.
#[async_trait]
pub trait FocusArray: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// Elements and clock, as the controller states them.
    fn identity(&self) -> &ArrayIdentity;

    /// Ends all emission.
    async fn silence(&mut self) -> Result<(), RigError>;

    /// What another process sends to silence the array if this one ends: `self.wire.emergency(bytes)`.
    fn emergency(&self) -> Option<Emergency>;

    /// Sets the delay of each element, numbered as in the scan. Does not start emission.
    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError>;

    /// Emits without modulation from now on: a scan measures the carrier, and modulation serves touch.
    async fn continuous_wave(&mut self) -> Result<(), RigError>;

    /// Emits with the delays last set.
    async fn emit(&mut self) -> Result<(), RigError>;

    /// Checks that the array still emits, or is still silent, as commanded. A reading taken across a restart is not valid.
    /// Controllers that cannot be queried are assumed to be right.
    async fn confirm(&mut self, _emits: bool) -> Result<(), RigError> {
        Ok(())
    }

    /// Sends the current pattern again, for controllers whose restart cannot be detected. Called before each point.
    async fn refresh(&mut self) -> Result<(), RigError> {
        Ok(())
    }

    /// Ends all emission and takes a display to be played.
    async fn load(&mut self, _display: &DriveProgram) -> Result<(), RigError> {
        Err(unable(self.device(), "loading a display", Cause::NoDisplays))
    }

    /// Plays the display last loaded, `loops` times (0: without end). The array falls silent after the last loop, and if the
    /// host sends nothing for as long as `lease`.
    async fn play(
        &mut self,
        _display: &DriveProgram,
        _loops: u32,
        _lease: Duration,
    ) -> Result<(), RigError> {
        Err(unable(self.device(), "starting a display", Cause::NoDisplays))
    }

    /// Whether a display is playing. The query renews the lease.
    async fn is_playing(&mut self) -> Result<bool, RigError> {
        Ok(false)
    }

    /// Receives with some elements at `rate_hz` samples per second. These elements are silent from now on.
    async fn listen(&mut self, _elements: &[usize], _rate_hz: f64) -> Result<(), RigError> {
        Err(unable(self.device(), "starting to receive", Cause::NoSensors))
    }

    /// The next sample of the receiving elements, or `None` when `until` has come.
    async fn next_sample(&mut self, _until: Instant) -> Result<Option<Sensed>, RigError> {
        Err(unable(self.device(), "receiving", Cause::NoSensors))
    }
}

fn unable(device: &Device, attempt: &str, cause: Cause) -> RigError {
    RigError::new(device.clone(), attempt, cause, None)
}
