//! Serial ports.

use std::io::{self, ErrorKind as Io};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::path::Path;

use jiff::Timestamp;
use tokio_serial::SerialStream;

use super::{ByteLink, Wire, replayed};
use crate::device::{Device, Role};
use crate::emergency::SpareHandle;
use crate::error::{Cause, RigError};

/// Opens a serial port for one device alone (8 data bits, no parity, 1 stop bit, no flow control).
///
/// `chosen` (from a virtual rig) goes before `configured` (from the rig file). Opening raises DTR, which
/// resets many boards, so a driver must expect its device to be starting up. Pseudo-terminals have no DTR
/// and need none.
///
/// # Errors
/// That there is no such port (with those that exist), that another program holds it, or that the system
/// refuses it.
pub fn open_serial(
    role: Role,
    chosen: Option<&str>,
    configured: Option<&str>,
    baud: u32,
) -> Result<Wire<Box<dyn ByteLink>>, RigError> {
    let attempt = "opening the port";
    let Some(port) = chosen.or(configured) else {
        return Err(RigError::new(Device::new(role, ""), attempt, Cause::NoPort, None));
    };
    let device = Device::new(role, port);
    if let Some((link, opening)) = replayed::take() {
        let link: Box<dyn ByteLink> = Box::new(link);
        return Ok(Wire::numbered(link, device, opening));
    }
    let builder = serialport::new(port, baud).exclusive(true);
    let failed = |cause| RigError::new(device.clone(), attempt, cause, None);
    let stream =
        SerialStream::open(&builder).map_err(|error| failed(why_not_opened(port, error)))?;
    let spare = spare_handle(&stream, baud).map_err(|error| failed(Cause::Io(error)))?;
    let link: Box<dyn ByteLink> = Box::new(stream);
    // Openings soon after each other have different numbers; it wraps about once a minute.
    let opening = (Timestamp::now().as_millisecond() & 0xffff) as u16;
    Ok(Wire::numbered(link, device, opening).with_spare(spare))
}

fn spare_handle(stream: &SerialStream, baud: u32) -> io::Result<SpareHandle> {
    // SAFETY: the stream owns the handle and lives throughout this call.
    let handle = unsafe { BorrowedFd::borrow_raw(stream.as_raw_fd()) };
    Ok(SpareHandle::new(handle.try_clone_to_owned()?, baud))
}

fn why_not_opened(port: &str, error: serialport::Error) -> Cause {
    use serialport::ErrorKind::{Io as SystemError, NoDevice};
    match error.kind() {
        _ if !Path::new(port).exists() && cfg!(unix) => {
            Cause::PortMissing { available: serial_ports() }
        }
        NoDevice | SystemError(Io::WouldBlock | Io::ResourceBusy) => Cause::PortBusy,
        _ => Cause::PortUnusable(error),
    }
}

/// The serial ports of this machine, by name; empty if they cannot be listed.
pub fn serial_ports() -> Vec<String> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports.into_iter().map(|port| port.port_name).collect()
}
