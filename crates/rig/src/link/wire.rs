//! The link to one device, with what messages need: the device, the attempt, the last line received.

use std::future::poll_fn;
use std::io;
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{Instant, timeout_at};

use super::ByteLink;
use super::wire_log::WireLog;
use crate::device::Device;
use crate::emergency::{Emergency, SpareHandle};
use crate::error::{Cause, RigError};

/// The longest line that is taken from a device, bytes. More without a line end is noise.
const LONGEST_LINE: usize = 4096;

/// How long a device may keep the program from writing.
const WRITE_WITHIN: Duration = Duration::from_secs(5);

/// How much of the last line a message shows, characters.
const SHOWN: usize = 120;

/// The two directions of one device's link, with what messages need to know: which device, what is being
/// tried, what was received last.
///
/// Every method may be cancelled (its future dropped): bytes read are kept for the next call, and
/// what is left of a line half written goes out before the next one, so that no two lines ever mix.
#[derive(Debug)]
pub struct Wire<L> {
    link: L,
    device: Device,
    spare: Option<SpareHandle>,
    log: Option<WireLog>,
    opening: u16,
    attempt: String,
    last_received: Option<String>,
    incoming: Vec<u8>,
    outgoing: Vec<u8>,
}

impl<L: ByteLink> Wire<L> {
    /// Takes `link` as the way to `device`. Within [`WireLogs::around`](super::WireLogs::around) it is logged.
    pub fn new(link: L, device: Device) -> Self {
        Self::numbered(link, device, 0)
    }

    /// As [`Wire::new`], with a number of this opening.
    pub fn numbered(link: L, device: Device, opening: u16) -> Self {
        Self {
            link,
            log: WireLog::opened(&device, opening),
            opening,
            device,
            spare: None,
            attempt: "opening".to_owned(),
            last_received: None,
            incoming: Vec::new(),
            outgoing: Vec::new(),
        }
    }

    /// Keeps a second handle of the port, for an emergency.
    pub fn with_spare(self, spare: SpareHandle) -> Self {
        Self { spare: Some(spare), ..self }
    }

    /// That `bytes` make the device safe; `None` where another process cannot send them, as on a pipe in memory.
    pub fn emergency(&self, bytes: impl Into<Vec<u8>>) -> Option<Emergency> {
        let spare = self.spare.clone()?;
        Some(Emergency { device: self.device.clone(), bytes: bytes.into(), spare })
    }

    /// A number that distinguishes this opening from those just before it, whose answers may still arrive.
    pub fn opening(&self) -> u16 {
        self.opening
    }

    /// The device at the other end.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Names the present attempt, for messages: “moving to …”.
    pub fn attempting(&mut self, attempt: impl Into<String>) {
        self.attempt = attempt.into();
    }

    /// A fault of the present attempt.
    pub fn error(&self, cause: Cause) -> RigError {
        RigError::new(self.device.clone(), &self.attempt, cause, self.last_received.clone())
    }

    /// Sends bytes, after whatever an earlier, cancelled call left unsent.
    ///
    /// They are not waited for to leave the port (`flush` blocks the thread on serial ports).
    ///
    /// # Errors
    /// That the port is gone, fails, or takes no bytes.
    pub async fn send(&mut self, bytes: &[u8]) -> Result<(), RigError> {
        tracing::debug!(device = %self.device, sent = %printable(bytes));
        self.outgoing.extend_from_slice(bytes);
        let until = Instant::now() + WRITE_WITHIN;
        while !self.outgoing.is_empty() {
            match timeout_at(until, self.link.write(&self.outgoing)).await {
                Ok(Ok(0)) => return Err(self.error(Cause::Disconnected)),
                Ok(Ok(written)) => {
                    self.log.iter().for_each(|log| log.sent(&self.outgoing[..written]));
                    self.outgoing.drain(..written);
                }
                Ok(Err(error)) => return Err(self.error(port_fault(error))),
                Err(_) => return Err(self.error(Cause::Silent { waited: WRITE_WITHIN })),
            }
        }
        Ok(())
    }

    /// The next line without its end, or `None` when `until` has come. Empty lines are passed over.
    ///
    /// Bytes that are no UTF-8 are replaced, so that a garbled line is seen as such.
    ///
    /// # Errors
    /// That the port is gone or fails, or that more came without a line end than any line is long.
    pub async fn line(&mut self, until: Instant) -> Result<Option<String>, RigError> {
        loop {
            while let Some(end) = self.incoming.iter().position(|&byte| byte == b'\n') {
                let line: Vec<u8> = self.incoming.drain(..=end).collect();
                let line = String::from_utf8_lossy(&line).trim().to_owned();
                if !line.is_empty() {
                    self.note_received(line.as_bytes());
                    return Ok(Some(line));
                }
            }
            if self.incoming.len() > LONGEST_LINE {
                let seen = printable(&self.incoming);
                self.incoming.clear();
                return Err(self.error(Cause::Unreadable { seen }));
            }
            if !self.read_more(until).await? {
                return Ok(None);
            }
        }
    }

    /// The bytes that have come, at least one, or none when `until` has come. For drivers whose device
    /// does not speak in lines.
    ///
    /// # Errors
    /// As [`Wire::line`].
    pub async fn bytes(&mut self, until: Instant) -> Result<Vec<u8>, RigError> {
        if self.incoming.is_empty() {
            self.read_more(until).await?;
        }
        Ok(std::mem::take(&mut self.incoming))
    }

    /// Gives bytes back that were taken by [`Wire::bytes`] and belong to what is read next.
    pub fn put_back(&mut self, mut bytes: Vec<u8>) {
        bytes.append(&mut self.incoming);
        self.incoming = bytes;
    }

    /// Notes what was received, for messages.
    pub fn note_received(&mut self, bytes: &[u8]) {
        let line = printable(bytes);
        tracing::debug!(device = %self.device, received = %line);
        self.last_received = Some(line);
    }

    /// Sends `bytes` as far as the port takes them at once, without waiting: the last thing that can be done
    /// where nothing can be awaited, as in `drop`. A serial port that was never written to before does not
    /// know yet that it takes bytes, and takes none.
    pub fn send_without_waiting(&mut self, bytes: &[u8]) {
        self.outgoing.extend_from_slice(bytes);
        let link = &mut self.link;
        let outgoing = &self.outgoing;
        let mut written = 0;
        // Outside of the task's cooperative budget, which may be spent when it is being dropped.
        let writing = pin!(tokio::task::unconstrained(poll_fn(|context| {
            while written < outgoing.len() {
                match Pin::new(&mut *link).poll_write(context, &outgoing[written..]) {
                    Poll::Ready(Ok(more)) if more > 0 => written += more,
                    _ => break,
                }
            }
            Poll::Ready(())
        })));
        let _ = writing.poll(&mut Context::from_waker(Waker::noop()));
        self.log.iter().for_each(|log| log.sent(&self.outgoing[..written]));
        self.outgoing.clear();
    }

    /// Waits for bytes; false when `until` has come first.
    async fn read_more(&mut self, until: Instant) -> Result<bool, RigError> {
        let mut buffer = [0; 1024];
        match timeout_at(until, self.link.read(&mut buffer)).await {
            // On a pseudo-terminal this is how unplugging reads.
            Ok(Ok(0)) => Err(self.error(Cause::Disconnected)),
            Ok(Ok(count)) => {
                self.log.iter().for_each(|log| log.received(&buffer[..count]));
                self.incoming.extend_from_slice(&buffer[..count]);
                Ok(true)
            }
            Ok(Err(error)) => Err(self.error(port_fault(error))),
            Err(_) => Ok(false),
        }
    }
}

fn port_fault(error: io::Error) -> Cause {
    // A port whose other end is gone fails with EIO (5 on every Unix), which std has no name for.
    const EIO: i32 = 5;
    let gone = matches!(error.kind(), io::ErrorKind::BrokenPipe | io::ErrorKind::UnexpectedEof);
    if gone || (cfg!(unix) && error.raw_os_error() == Some(EIO)) {
        Cause::Disconnected
    } else {
        Cause::Io(error)
    }
}

fn printable(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let mut shown: String = text.trim_end().escape_debug().take(SHOWN).collect();
    if text.chars().count() > SHOWN {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use tokio::io::{DuplexStream, duplex};

    use super::*;
    use crate::device::Role;

    fn pair(capacity: usize) -> (Wire<DuplexStream>, DuplexStream) {
        let (near, far) = duplex(capacity);
        (Wire::new(near, Device::new(Role::Robot, "memory")), far)
    }

    fn soon() -> Instant {
        Instant::now() + Duration::from_secs(1)
    }

    #[tokio::test(start_paused = true)]
    async fn lines_come_one_by_one_however_the_bytes_are_cut() {
        let (mut wire, mut far) = pair(64);
        far.write_all(b"ok\r\n\r\nsta").await.expect("room");
        assert_eq!(wire.line(soon()).await.expect("open").as_deref(), Some("ok"));
        assert_eq!(wire.line(soon()).await.expect("open"), None);
        far.write_all(b"rt\n").await.expect("room");
        assert_eq!(wire.line(soon()).await.expect("open").as_deref(), Some("start"));
    }

    #[tokio::test(start_paused = true)]
    async fn endless_noise_is_an_error_and_not_a_full_memory() {
        let (mut wire, mut far) = pair(2 * LONGEST_LINE);
        far.write_all(&[0xff; LONGEST_LINE + 1024]).await.expect("room");
        let error = wire.line(soon()).await.expect_err("no line end");
        assert!(matches!(error.cause(), Cause::Unreadable { .. }), "{error}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_closed_link_is_a_disconnection() {
        let (mut wire, far) = pair(64);
        drop(far);
        wire.attempting("asking");
        let error = wire.line(soon()).await.expect_err("closed");
        assert_eq!(error.to_string(), "robot on memory, asking: the port was disconnected");
        let error = wire.send(b"x\n").await.expect_err("closed");
        assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_line_half_written_when_cancelled_is_finished_before_the_next() {
        let (mut wire, mut far) = pair(4);
        let cancelled = tokio::time::timeout(Duration::from_millis(1), wire.send(b"delays 1 2\n"));
        assert!(cancelled.await.is_err(), "four bytes fit and the rest must wait");
        let received = tokio::spawn(async move {
            let mut received = String::new();
            far.read_to_string(&mut received).await.expect("text");
            received
        });
        wire.send(b"off\n").await.expect("open");
        drop(wire);
        assert_eq!(received.await.expect("no panic"), "delays 1 2\noff\n");
    }

    #[tokio::test(start_paused = true)]
    async fn a_device_that_takes_no_bytes_is_given_up() {
        let (mut wire, _far) = pair(4);
        let error = wire.send(b"12345\n").await.expect_err("nobody reads");
        assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
    }

    #[tokio::test]
    async fn bytes_are_sent_without_waiting() {
        let (mut wire, mut far) = pair(64);
        wire.send_without_waiting(b"off\n");
        drop(wire);
        let mut received = String::new();
        far.read_to_string(&mut received).await.expect("text");
        assert_eq!(received, "off\n");
    }
}
