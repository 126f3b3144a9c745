//! A link for tests that holds a device's answers back and then hands them over in slices, as an overloaded computer or a
//! hub does.

use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};
use tokio::sync::watch;
use tokio::time::sleep;

/// The host's end of a link to `device`, and what holds its answers back while it is true. What was held back then comes in
/// slices of so many bytes, one after each pause.
pub(super) fn held_link(
    device: DuplexStream,
    slice: usize,
    pause: Duration,
) -> (DuplexStream, watch::Sender<bool>) {
    let (host, relay) = duplex(64 * 1024);
    let (hold, held) = watch::channel(false);
    let (mut from_host, mut to_host) = tokio::io::split(relay);
    let (mut from_device, mut to_device) = tokio::io::split(device);
    tokio::spawn(async move { tokio::io::copy(&mut from_host, &mut to_device).await });
    tokio::spawn(async move {
        let (mut held, mut backlog, mut is_late) = (held, Vec::new(), false);
        let mut bytes = [0; 4096];
        loop {
            let holds = *held.borrow_and_update();
            is_late = holds || (is_late && !backlog.is_empty());
            let hands_over = !holds && is_late;
            tokio::select! {
                biased;
                read = from_device.read(&mut bytes) => match read {
                    Ok(count) if count > 0 => backlog.extend_from_slice(&bytes[..count]),
                    _ => return,
                },
                changed = held.changed() => if changed.is_err() { return },
                () = sleep(pause), if hands_over => {
                    let next: Vec<u8> = backlog.drain(..slice.min(backlog.len())).collect();
                    if to_host.write_all(&next).await.is_err() {
                        return;
                    }
                    continue;
                }
            }
            if !is_late && !*held.borrow() {
                let next = std::mem::take(&mut backlog);
                if to_host.write_all(&next).await.is_err() {
                    return;
                }
            }
        }
    });
    (host, hold)
}
