//! The devices of a laboratory: a robot that carries a receiver through the field of a phased array.
//!
//! Three traits say what a scan needs of them and nothing more: [`Motion`], [`Receiver`], [`FocusArray`].
//! Behind each stand drivers, one file or folder a driver, registered in one line of
//! [`config`]; drivers speak over a [`link`], a serial port or an in-memory pipe.
//! [`SafeRig`] owns all three and knows how to end safe.
//!
//! This layer knows no physics: it takes delays and gives readings.

pub mod check;
pub mod config;
mod device;
mod error;
pub mod focus_array;
pub mod link;
pub mod motion;
pub mod receiver;
mod safety;
mod space;

use std::time::Duration;

use async_trait::async_trait;

pub use config::{FocusArrayConfig, MotionConfig, ReceiverConfig, RigConfig};
pub use device::{Device, Role};
pub use error::{Cause, RigError};
pub use focus_array::{ArrayIdentity, ElementDelay};
pub use motion::travel::{Envelope, PathFault};
pub use receiver::{Reading, ReceiverIdentity};
pub use safety::{Ports, SafeRig, SafetyReport, open};
pub use space::{Feed, Frame, RobotPosition};

/// A robot that carries the receiver along straight paths.
#[async_trait]
pub trait Motion: Send {
    /// Which device this is, for messages.
    fn device(&self) -> &Device;

    /// What the firmware calls itself, as it was heard when the device was opened.
    fn firmware(&self) -> &str;

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

    /// Sets the delay of each element, numbered as in the scan. Does not start emission.
    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError>;

    /// Emits without modulation from now on: a scan reads the carrier, and modulation is for hands.
    async fn continuous_wave(&mut self) -> Result<(), RigError>;

    /// Emits with the delays last set.
    async fn emit(&mut self) -> Result<(), RigError>;
}
