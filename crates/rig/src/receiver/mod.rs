//! Receivers: identity, readings, recordings, and the drivers.
//!
//! Settling is measured on the receiver's own clock, from its time stamps: the host's clock, its scheduler and the
//! buffers in between do not affect which sample belongs to a point.

mod binary;
mod config;
mod free_running;
#[cfg(test)]
mod held_link;
mod marlin_pin;
pub mod protocol;
mod reading;
mod recording;
mod run;
mod scpi;
mod stream;
mod text;

pub use crate::error::RecordFault;
pub use config::{Encoding, FreeRunningConfig, Lines, StreamConfig};
pub use free_running::FreeRunningReceiver;
pub use marlin_pin::{MarlinPinConfig, MarlinPinReceiver};
pub use reading::{Reading, ReadingBuilder, ReceiverIdentity};
pub use recording::{DuringRecording, Recording, TimedSample};
pub use scpi::{ScpiConfig, ScpiReceiver};
pub use stream::StreamReceiver;
