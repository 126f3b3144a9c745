//! The bytes that make a device safe when the program that opened it has ended.

use std::fmt;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;

use super::device::Device;

/// A second handle of a device's open port, and its speed.
///
/// It outlives the first in another process: the port does not close with the program that opened it, so nothing
/// resets the board behind it.
#[derive(Debug, Clone)]
pub struct SpareHandle {
    handle: Arc<OwnedFd>,
    baud: u32,
}

impl SpareHandle {
    /// A handle of a port that runs at `baud` bits a second.
    pub fn new(handle: OwnedFd, baud: u32) -> Self {
        Self { handle: Arc::new(handle), baud }
    }

    /// The port's speed, bits a second.
    pub fn baud(&self) -> u32 {
        self.baud
    }
}

impl AsFd for SpareHandle {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.handle.as_fd()
    }
}

/// What makes one device safe: bytes that end emission or motion whatever was sent before, and a handle to send
/// them by.
#[derive(Debug, Clone)]
pub struct Emergency {
    /// The device.
    pub device: Device,
    /// What is sent, to be understood also behind a line that was broken off.
    pub bytes: Vec<u8>,
    /// The handle of its port.
    pub spare: SpareHandle,
}

impl fmt::Display for Emergency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: `{}`", self.device, self.bytes.escape_ascii())
    }
}
