//! Receivers: what they say, what a reading is, and the drivers.

mod config;
mod reading;

pub use config::{Encoding, FreeRunningConfig, StreamConfig};
pub use reading::{Reading, ReceiverIdentity};
