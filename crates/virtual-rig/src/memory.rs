//! A virtual rig without ports, for tests in paused time. Its devices are reached by pipes in memory, which outlive the driver.

use std::io;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, DuplexStream, ReadBuf, duplex};
use tokio::sync::mpsc::unbounded_channel;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::board::{self, DeviceEnd, WireFaults};
use super::clock::Clock;
use super::config::VirtualConfig;
use super::truth::Truth;
use super::world::{Believed, World};
use super::{Devices, VirtualRigError};

/// Bytes that a device's buffers hold in all.
const CAPACITY: usize = 64 * 1024;

impl DeviceEnd for DuplexStream {
    type Stream = Self;

    fn stream(&mut self) -> &mut Self {
        self
    }
}

/// The host's end of a device's wire. All clones share it.
#[derive(Debug, Clone)]
pub struct Plug {
    stream: Arc<Mutex<DuplexStream>>,
    lines: Arc<AtomicU64>,
}

impl Plug {
    fn lock(&self) -> MutexGuard<'_, DuplexStream> {
        self.stream.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl AsyncRead for Plug {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut *self.lock()).poll_read(context, buffer)
    }
}

impl AsyncWrite for Plug {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut *self.lock()).poll_write(context, bytes);
        if let Poll::Ready(Ok(count)) = &written {
            let lines = bytes[..*count].iter().filter(|&&byte| byte == b'\n').count();
            self.lines.fetch_add(lines as u64, Ordering::Relaxed);
        }
        written
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut *self.lock()).poll_flush(context)
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

/// A virtual rig that runs on the present runtime until it is dropped.
pub struct MemoryRig {
    /// What the devices act on.
    pub world: Arc<World>,
    /// The clock of all devices.
    pub clock: Arc<Clock>,
    plugs: [Plug; 3],
    lines: Arc<AtomicU64>,
    _stop: DropGuard,
}

impl MemoryRig {
    /// Powers a rig up, with the fault rates of its configuration.
    ///
    /// # Errors
    /// See [`VirtualRigError`].
    pub fn power_up(
        config: &VirtualConfig,
        truth: Truth,
        believed: &Believed,
    ) -> Result<Self, VirtualRigError> {
        let clock = Arc::new(Clock::new(config.pace));
        let (devices, world) = Devices::new(config, truth, believed, &clock, &Arc::default())?;
        let stop = CancellationToken::new();
        let lines = Arc::new(AtomicU64::new(0));
        let wire = || {
            let (host, device) = duplex(CAPACITY);
            (Plug { stream: Arc::new(Mutex::new(host)), lines: Arc::clone(&lines) }, device)
        };
        let [faults_1, faults_2, faults_3, _] = WireFaults::of(config);
        let Devices { robot, receiver, array, .. } = devices;
        let [(plug_1, end_1), (plug_2, end_2), (plug_3, end_3)] = [wire(), wire(), wire()];
        let shared = || (Arc::clone(&clock), unbounded_channel().1, stop.clone());
        let (clock_1, orders, stop_1) = shared();
        tokio::spawn(board::run(robot, end_1, faults_1, clock_1, orders, stop_1));
        let (clock_2, orders, stop_2) = shared();
        tokio::spawn(board::run(receiver, end_2, faults_2, clock_2, orders, stop_2));
        let (clock_3, orders, stop_3) = shared();
        tokio::spawn(board::run(array, end_3, faults_3, clock_3, orders, stop_3));
        let plugs = [plug_1, plug_2, plug_3];
        Ok(Self { world, clock, plugs, lines, _stop: stop.drop_guard() })
    }

    /// The wires of robot, receiver and array.
    pub fn plugs(&self) -> [Plug; 3] {
        self.plugs.clone()
    }

    /// Lines that were sent to the devices so far.
    pub fn lines_sent(&self) -> u64 {
        self.lines.load(Ordering::Relaxed)
    }
}
