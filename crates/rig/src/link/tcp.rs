//! Network sockets, as instruments have them.

use std::io::ErrorKind as Io;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::time::timeout;

use super::{ByteLink, Wire, replayed};
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};

/// How long an instrument may take to be reached.
const REACHED_WITHIN: Duration = Duration::from_secs(5);

/// Opens a socket to an instrument, `host:port`.
///
/// # Errors
/// That nothing listens there, or that it cannot be reached in time.
pub async fn open_tcp(role: Role, address: &str) -> Result<Wire<Box<dyn ByteLink>>, RigError> {
    let device = Device::new(role, address);
    if let Some((link, opening)) = replayed::take() {
        let link: Box<dyn ByteLink> = Box::new(link);
        return Ok(Wire::numbered(link, device, opening));
    }
    let failed = |cause| RigError::new(device.clone(), "connecting", cause, None);
    match timeout(REACHED_WITHIN, TcpStream::connect(address)).await {
        Ok(Ok(stream)) => {
            // Questions are short, and each waits for its answer.
            stream.set_nodelay(true).map_err(|error| failed(Cause::Io(error)))?;
            let link: Box<dyn ByteLink> = Box::new(stream);
            Ok(Wire::new(link, device))
        }
        Ok(Err(error)) if error.kind() == Io::ConnectionRefused => Err(failed(Cause::NoListener)),
        Ok(Err(error)) => Err(failed(Cause::Io(error))),
        Err(_) => Err(failed(Cause::Silent { waited: REACHED_WITHIN })),
    }
}
