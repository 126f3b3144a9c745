//! A pseudo-terminal: the wire between a device's firmware and whoever opens its port.

use serialport::{SerialPort, TTYPort};
use tokio_serial::SerialStream;

/// The device's end of a pseudo-terminal in raw mode, without echo.
///
/// The other end is a path such as `/dev/pts/7`, which any serial program opens as a port. It can be closed and opened again: a
/// handle of that end is kept here, so that the device reads no error when its last client leaves. As with a real board, the
/// device does not notice clients. Answers that one client did not read reach the next one, unless it discards them.
#[derive(Debug)]
pub struct PseudoTerminal {
    /// The device's end.
    pub stream: SerialStream,
    client_end: TTYPort,
    path: String,
}

impl PseudoTerminal {
    /// Opens a pair. Must be called within a Tokio runtime.
    ///
    /// # Errors
    /// If the system has no pseudo-terminal left, or does not say the path of the client's end.
    pub fn open() -> serialport::Result<Self> {
        let (device_end, client_end) = TTYPort::pair()?;
        let path = client_end.name().ok_or_else(|| {
            serialport::Error::new(
                serialport::ErrorKind::NoDevice,
                "the system does not say the path of the pseudo-terminal",
            )
        })?;
        let stream = SerialStream::try_from(device_end)?;
        Ok(Self { stream, client_end, path })
    }

    /// The path that a client opens.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Lets a new client open the port after one was killed that held it exclusively.
    ///
    /// The kernel ends a port's exclusive mode when its last handle is closed, which the handle kept here prevents. A duplicate of
    /// that handle ends the mode as it is dropped. Serial libraries also lock the port's file, which still protects clients from
    /// each other.
    pub fn forget_dead_client(&self) {
        drop(self.client_end.try_clone_native());
    }
}
