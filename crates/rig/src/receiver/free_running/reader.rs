//! Reads a receiver without pause, also while nobody asks, so that nothing old waits in buffers.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::task::JoinHandle;
use tokio::time::{Instant, timeout_at};

use super::QUIET;
use super::clock_tie::ClockTie;
use super::samples::{Sample, SampleDecoder, Stamp, Unwrapped};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};

/// A sample and its place on the receiver's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    pub(super) sample: Sample,
    /// Its time on the receiver's clock, without wraps, s.
    pub(super) t_s: f64,
}

/// What has been read.
#[derive(Debug)]
pub(super) struct Stream {
    unwrapped: Unwrapped,
    /// The receiver's clock tied to this computer's.
    pub(super) tie: ClockTie,
    /// Samples since they were last taken; none is kept while nobody wants them.
    samples: Vec<Placed>,
    wanted: bool,
    /// How often the receiver's clock has jumped.
    pub(super) jumps: u32,
    /// When the newest sample arrived, on this computer's clock, and its time on the receiver's, s.
    pub(super) newest: Option<(f64, f64)>,
    /// The last bytes that are no sample.
    pub(super) unreadable: Option<String>,
    failure: Option<RigError>,
    ended: bool,
}

/// A task that reads, and what it has read. It ends when this is dropped.
#[derive(Debug)]
pub(super) struct Reader {
    stream: Arc<Mutex<Stream>>,
    changed: Arc<Notify>,
    /// The beginning of this computer's time.
    origin: Instant,
    task: JoinHandle<()>,
}

impl Reader {
    pub(super) fn start<L: ByteLink>(
        wire: Wire<L>,
        decoder: SampleDecoder,
        rate_hz: f64,
        own_clock: bool,
    ) -> Self {
        let stream = Arc::new(Mutex::new(Stream {
            unwrapped: Unwrapped::new(rate_hz),
            tie: ClockTie::new(rate_hz, own_clock),
            samples: Vec::new(),
            wanted: false,
            jumps: 0,
            newest: None,
            unreadable: None,
            failure: None,
            ended: false,
        }));
        let changed = Arc::new(Notify::new());
        let origin = Instant::now();
        let reading = read(wire, decoder, origin, Arc::clone(&stream), Arc::clone(&changed));
        Self { stream, changed, origin, task: tokio::spawn(reading) }
    }

    /// This computer's time of an instant, s.
    pub(super) fn seconds(&self, instant: Instant) -> f64 {
        (instant - self.origin).as_secs_f64()
    }

    /// What has been read so far.
    pub(super) fn stream(&self) -> MutexGuard<'_, Stream> {
        locked(&self.stream)
    }

    /// Waits for more, at most until `until`.
    ///
    /// # Errors
    /// That the port failed.
    pub(super) async fn more(&self, until: Instant) -> Result<(), Option<RigError>> {
        // The permit of a change between two calls is kept.
        let _ = timeout_at(until, self.changed.notified()).await;
        let mut stream = self.stream();
        if stream.ended { Err(stream.failure.take()) } else { Ok(()) }
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Stream {
    /// From now on samples are kept; earlier ones are dropped.
    pub(super) fn begin_keeping(&mut self) {
        self.samples.clear();
        self.wanted = true;
    }

    /// From now on no samples are kept.
    pub(super) fn end_keeping(&mut self) {
        self.samples = Vec::new();
        self.wanted = false;
    }

    /// The samples kept since the last call.
    pub(super) fn take_samples(&mut self) -> Vec<Placed> {
        std::mem::take(&mut self.samples)
    }

    fn take(&mut self, sample: Sample, arrived_s: f64) {
        let t_s = match self.unwrapped.stamp(sample) {
            Stamp::Damaged => return,
            Stamp::Time(t_s) => t_s,
            Stamp::Jump(t_s) => {
                self.tie.restart();
                self.samples.clear();
                self.jumps += 1;
                t_s
            }
        };
        self.tie.take(t_s, arrived_s);
        self.newest = Some((arrived_s, t_s));
        if self.wanted {
            self.samples.push(Placed { sample, t_s });
        }
    }
}

async fn read<L: ByteLink>(
    mut wire: Wire<L>,
    mut decoder: SampleDecoder,
    origin: Instant,
    stream: Arc<Mutex<Stream>>,
    changed: Arc<Notify>,
) {
    wire.attempting("reading samples");
    loop {
        let bytes = wire.bytes(Instant::now() + QUIET).await;
        let arrived_s = origin.elapsed().as_secs_f64();
        let mut stream = locked(&stream);
        match bytes {
            Ok(bytes) => {
                for sample in decoder.push(&bytes) {
                    stream.take(sample, arrived_s);
                }
                stream.unreadable.clone_from(&decoder.unreadable);
            }
            Err(error) => {
                (stream.failure, stream.ended) = (Some(error), true);
                changed.notify_one();
                return;
            }
        }
        drop(stream);
        changed.notify_one();
    }
}

fn locked(stream: &Mutex<Stream>) -> MutexGuard<'_, Stream> {
    stream.lock().unwrap_or_else(PoisonError::into_inner)
}

/// That a device was silent for as long as a receiver may be.
pub(super) fn silent() -> Cause {
    Cause::Silent { waited: QUIET }
}

/// A duration of so many seconds, or as long as a receiver may be silent.
pub(super) fn duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(QUIET)
}
