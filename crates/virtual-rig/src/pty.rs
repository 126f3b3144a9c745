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
        // Programs that are started inherit these handles, which would keep the port open. They do not inherit duplicates.
        let (device_end, client_end) =
            (device_end.try_clone_native()?, client_end.try_clone_native()?);
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

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::process::{Command, Stdio};

    use super::*;

    #[tokio::test]
    async fn a_port_closes_while_a_program_goes_on_that_was_started_meanwhile() {
        let terminal = PseudoTerminal::open().expect("a pair");
        let mut client = serialport::new(terminal.path(), 115_200).open().expect("a port");
        let mut program = Command::new("cat")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        // It has given up the handles that it does not inherit when it answers, and not yet when it was started.
        program.stdin.as_mut().expect("piped").write_all(b"?").expect("it reads");
        program.stdout.as_mut().expect("piped").read_exact(&mut [0]).expect("it answers");
        client.write_all(b"here\n").expect("the device is there");
        drop(terminal);
        let written = client.write_all(b"gone\n");
        program.kill().expect("it still runs");
        program.wait().expect("it ends");
        assert!(written.is_err());
    }
}
