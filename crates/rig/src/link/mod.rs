//! Bytes to and from a device: over a serial port, or over a pipe in memory.
//!
//! Drivers are generic over [`ByteLink`]; what they share, lines with a bounded length and reads that never wait
//! without a limit, is in [`Wire`].

pub mod fault_injection;
mod holder;
pub(crate) mod replayed;
mod serial;
mod tcp;
mod wire;
mod wire_log;

use std::fmt;

use tokio::io::{AsyncRead, AsyncWrite};

pub use holder::{Holder, holder_of};
pub use serial::{open_serial, serial_ports};
pub use tcp::open_tcp;
pub use wire::Wire;
pub use wire_log::{WireLogs, read_wire_log};

/// Anything that carries bytes both ways: a serial port, or one end of [`tokio::io::duplex`].
pub trait ByteLink: AsyncRead + AsyncWrite + Unpin + Send + 'static {}

impl<L: AsyncRead + AsyncWrite + Unpin + Send + 'static> ByteLink for L {}

impl fmt::Debug for dyn ByteLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a link")
    }
}
