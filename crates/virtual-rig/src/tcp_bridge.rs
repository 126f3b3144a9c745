//! A network socket in front of a pseudo-terminal, for devices that are reached over a network.

use tokio::io::{copy, split};
use tokio::net::{TcpListener, TcpStream};
use tokio_serial::SerialStream;
use tokio_util::sync::CancellationToken;

/// A free socket of the local machine, and its address.
pub(super) async fn listen() -> std::io::Result<(TcpListener, String)> {
    let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
    let address = listener.local_addr()?.to_string();
    Ok((listener, address))
}

/// Connects one client after the other to the device behind the pseudo-terminal at `path`, until it is stopped.
pub(super) async fn serve(listener: TcpListener, path: String, stop: CancellationToken) {
    loop {
        let client = tokio::select! {
            () = stop.cancelled() => return,
            client = listener.accept() => client,
        };
        let Ok((client, _)) = client else { continue };
        tokio::select! {
            () = stop.cancelled() => return,
            () = connect(client, &path) => {}
        }
    }
}

/// Carries bytes both ways until either side closes. An unplugged device closes the connection.
async fn connect(client: TcpStream, path: &str) {
    let Ok(device) = SerialStream::open(&serialport::new(path, 115_200)) else { return };
    let ((mut from_client, mut to_client), (mut from_device, mut to_device)) =
        (split(client), split(device));
    tokio::select! {
        _ = copy(&mut from_client, &mut to_device) => {}
        _ = copy(&mut from_device, &mut to_client) => {}
    }
}
