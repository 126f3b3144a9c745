//! The devices of a laboratory: a robot that carries a receiver through the field of a phased array.
//!
//! Three traits say what a scan needs of them and nothing more: [`Motion`], [`Receiver`], [`FocusArray`].
//! Behind each stand drivers, one file or folder a driver, registered in one line of
//! [`config`]; drivers speak over a [`link`], a serial port or an in-memory pipe.
//! [`SafeRig`] owns all three and knows how to end safe.
//!
//! This layer knows no physics: it takes delays and gives readings.

pub mod air_sensor;
mod by_hand;
mod call;
pub mod check;
pub mod config;
mod device;
mod emergency;
mod error;
pub mod focus_array;
pub mod link;
pub mod motion;
pub mod receiver;
pub mod replay;
mod safety;
mod space;
pub mod watchdog;

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

pub use air_sensor::AirReading;
pub use by_hand::{ByHand, MadeSafe, Wanted};
pub use config::{EnvironmentConfig, FocusArrayConfig, MotionConfig, ReceiverConfig, RigConfig};
pub use device::{Device, Role};
pub use emergency::{Emergency, SpareHandle};
pub use error::{Cause, RigError};
pub use focus_array::{ArrayIdentity, DriveProgram, ElementDelay, Sensed};
pub use motion::Advice;
pub use motion::travel::{Envelope, PathFault};
pub use receiver::{Meanwhile, Reading, ReceiverIdentity, Recording, TimedSample};
pub use safety::{Ports, SafeRig, SafetyReport, open, open_air_sensor, open_array};
pub use space::{Feed, Frame, RobotPosition};

/// A robot that carries the receiver along straight paths.
#[async_trait]
pub trait Motion: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// What the firmware calls itself, as it was heard when the device was opened.
    fn firmware(&self) -> &str;

    /// What the driver has found in the device that makes scans poorer than they need be.
    fn advice(&self) -> &[Advice] {
        &[]
    }

    /// Finds the origin of the robot's axes by its end switches and returns where it then stands.
    ///
    /// Must be done before the first move, and again after a stop, a reset or any failed move.
    async fn home(&mut self) -> Result<RobotPosition, RigError>;

    /// Moves straight to `target` and returns, once the robot stands still, where it says it is.
    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError>;

    /// Where the robot says it is. Also answers before homing, when the number means little.
    async fn position(&mut self) -> Result<RobotPosition, RigError>;

    /// Stops at once. The position is unknown afterwards.
    async fn stop(&mut self) -> Result<(), RigError>;

    /// What another process sends to stop the robot should this one be gone: `self.wire.emergency(bytes)`.
    fn emergency(&self) -> Option<Emergency>;
}

/// A receiver whose reading is the magnitude of the field where it stands.
#[async_trait]
pub trait Receiver: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// What the receiver says of itself: rate, range, unit.
    fn identity(&self) -> &ReceiverIdentity;

    /// Waits `settle` on the receiver's own clock, counted from now, and averages the `count` readings
    /// that follow. No reading is from before the call.
    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError>;

    /// Samples without a pause while something goes on, which begins once the receiver is sampling.
    ///
    /// Where this fails or is cancelled, what goes on is dropped in its middle.
    async fn record(&mut self, _meanwhile: Meanwhile<'_>) -> Result<Recording, RigError> {
        Err(unable(self.device(), "recording without a pause", Cause::NoRecording))
    }
}

/// A sensor of the air.
#[async_trait]
pub trait AirSensor: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// The newest that it has said.
    async fn air(&mut self) -> Result<AirReading, RigError>;
}

/// A phased array with a delay for each element.
#[async_trait]
pub trait FocusArray: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// What the controller says of itself: elements and clock.
    fn identity(&self) -> &ArrayIdentity;

    /// Ends all emission.
    async fn silence(&mut self) -> Result<(), RigError>;

    /// What another process sends to silence the array should this one be gone: `self.wire.emergency(bytes)`.
    fn emergency(&self) -> Option<Emergency>;

    /// Sets the delay of each element, numbered as in the scan. Does not start emission.
    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError>;

    /// Emits without modulation from now on: a scan reads the carrier, and modulation is for hands.
    async fn continuous_wave(&mut self) -> Result<(), RigError>;

    /// Emits with the delays last set.
    async fn emit(&mut self) -> Result<(), RigError>;

    /// Makes sure that the array still emits, or is silent, as it was told: one that restarted since is not what a reading is of.
    /// Controllers that cannot be asked are believed.
    async fn confirm(&mut self, _emits: bool) -> Result<(), RigError> {
        Ok(())
    }

    /// Tells the array again what it was told last, where nothing would show that it has forgotten. Before each point.
    async fn refresh(&mut self) -> Result<(), RigError> {
        Ok(())
    }

    /// Ends all emission and takes a display to be played.
    async fn load(&mut self, _display: &DriveProgram) -> Result<(), RigError> {
        Err(unable(self.device(), "loading a display", Cause::NoDisplays))
    }

    /// Plays the display last loaded so many times (0: for ever). It falls silent by itself after the last, and where
    /// nothing is heard of the host for as long as `lease`.
    async fn play(
        &mut self,
        _display: &DriveProgram,
        _loops: u32,
        _lease: Duration,
    ) -> Result<(), RigError> {
        Err(unable(self.device(), "starting a display", Cause::NoDisplays))
    }

    /// Whether a display still plays. Asking renews the lease.
    async fn is_playing(&mut self) -> Result<bool, RigError> {
        Ok(false)
    }

    /// Listens with some elements, which are silent from now on, so many times a second.
    async fn listen(&mut self, _elements: &[usize], _rate_hz: f64) -> Result<(), RigError> {
        Err(unable(self.device(), "starting to listen", Cause::NoSensors))
    }

    /// The next sample of the elements that listen, or `None` when `until` has come.
    async fn heard(&mut self, _until: Instant) -> Result<Option<Sensed>, RigError> {
        Err(unable(self.device(), "listening", Cause::NoSensors))
    }
}

fn unable(device: &Device, attempt: &str, cause: Cause) -> RigError {
    RigError::new(device.clone(), attempt, cause, None)
}
