//! The receiver that streams without being asked.
//!
//! It sends lines `<t_us> <value>`, with ` !` behind it where it clipped, or plain numbers, or frames, without end, and takes no
//! commands. A sample that arrives now may have been waiting in buffers since before the robot stood still. So samples are
//! read all the time ([`reader`]), and their own clock is tied to this computer's ([`clock_tie`]): a reading uses only samples
//! that were certainly taken after it was asked for.

mod clock_tie;
mod reader;
mod samples;
#[cfg(test)]
mod tests;

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

use self::reader::{Placed, Reader, duration, silent};
use self::samples::{SampleDecoder, elapsed_us};
use super::config::{FreeRunningConfig, Lines};
use super::reading::{Reading, ReadingBuilder, ReceiverIdentity};
use super::recording::{DuringRecording, Recording, TimedSample};
use crate::Receiver;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};

/// Silence after which the receiver is taken for lost, and how long samples may stay too old.
const QUIET: Duration = Duration::from_secs(5);

/// A receiver that streams samples without being asked.
#[derive(Debug)]
pub struct FreeRunningReceiver {
    reader: Reader,
    device: Device,
    attempt: &'static str,
    identity: ReceiverIdentity,
    latency_s: f64,
    lines: Lines,
}

impl FreeRunningConfig {
    pub(crate) async fn open(&self, port: Option<&str>) -> Result<Box<dyn Receiver>, RigError> {
        let wire = open_serial(Role::Receiver, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(FreeRunningReceiver::begin(wire, self).await?))
    }
}

impl FreeRunningReceiver {
    /// Begins to read, and waits for the first sample.
    ///
    /// # Errors
    /// That nothing comes, or nothing that is a sample.
    pub async fn begin<L: ByteLink>(
        wire: Wire<L>,
        config: &FreeRunningConfig,
    ) -> Result<Self, RigError> {
        let identity = ReceiverIdentity {
            rate_hz: config.rate_hz.get(),
            full_scale: config.full_scale.get(),
            unit: config.unit.clone(),
            own_clock: config.lines != Lines::Value,
            phase: false,
        };
        let device = wire.device().clone();
        let decoder = SampleDecoder::new(config);
        let receiver = Self {
            reader: Reader::start(wire, decoder, identity.rate_hz, identity.own_clock),
            device,
            attempt: "waiting for the first sample",
            identity,
            latency_s: config.latency_ms.get() * 1e-3,
            lines: config.lines,
        };
        let until = Instant::now() + QUIET;
        while receiver.reader.stream().newest.is_none() {
            if Instant::now() >= until {
                let unreadable = receiver.reader.stream().unreadable.take();
                let cause = unreadable.map_or_else(silent, |seen| Cause::Unreadable { seen });
                return Err(receiver.error(cause));
            }
            receiver.more(until).await?;
        }
        Ok(receiver)
    }

    async fn more(&self, until: Instant) -> Result<(), RigError> {
        let failed = self.reader.more(until.min(Instant::now() + QUIET)).await;
        failed.map_err(|failure| failure.unwrap_or_else(|| self.error(Cause::Disconnected)))
    }

    fn error(&self, cause: Cause) -> RigError {
        let seen = self.reader.stream().unreadable.clone();
        RigError::new(self.device.clone(), self.attempt, cause, seen)
    }

    /// Why no sample young enough came by now.
    fn too_late(&self, asked: usize) -> RigError {
        let now_s = self.reader.seconds(Instant::now());
        let newest = {
            let stream = self.reader.stream();
            stream.newest.map(|(arrived_s, t_s)| (arrived_s, stream.tie.receiver_s(now_s) - t_s))
        };
        let Some((arrived_s, age_s)) = newest else { return self.error(silent()) };
        if now_s - arrived_s >= QUIET.as_secs_f64() {
            self.error(silent())
        } else if age_s > QUIET.as_secs_f64() / 2.0 {
            self.error(Cause::FallenBehind { behind: duration(age_s) })
        } else {
            self.error(Cause::NoReadings { asked })
        }
    }

    /// The recording between two instants of this computer's time, once all its samples have arrived.
    fn recorded(&self, began_s: f64, ended_s: f64) -> Option<Recording> {
        let mut stream = self.reader.stream();
        let [began_s, ended_s] = [began_s, ended_s].map(|at_s| stream.tie.receiver_s(at_s));
        stream.newest.filter(|(_, t_s)| *t_s >= ended_s + self.latency_s)?;
        let samples = stream.take_samples().into_iter().map(|Placed { sample, t_s }| TimedSample {
            t_s,
            value: sample.value,
            clipped: sample.clipped,
        });
        let samples = samples.filter(|sample| sample.t_s >= began_s).collect();
        stream.end_keeping();
        Some(Recording { began_s, ended_s, samples })
    }

    /// Averages `count` samples that were taken at or after `from_s` of this computer's time.
    async fn average(
        &self,
        asked_s: f64,
        from_s: f64,
        count: usize,
        until: Instant,
    ) -> Result<Reading, RigError> {
        let period_us = 1e6 / self.identity.rate_hz;
        let mut taken: Vec<Placed> = Vec::new();
        let mut last: Option<Placed> = None;
        let (mut gaps, mut jumps) = (0, self.reader.stream().jumps);
        loop {
            {
                let mut stream = self.reader.stream();
                if stream.jumps != jumps {
                    (jumps, last) = (stream.jumps, None);
                    (gaps, taken) = (0, Vec::new());
                }
                for placed in stream.take_samples() {
                    let is_after = |from_s| stream.tie.is_after(placed.t_s, from_s, self.latency_s);
                    if !stream.tie.is_steady() && taken.is_empty() || !is_after(asked_s) {
                        continue;
                    }
                    if let Some(last) = last {
                        let elapsed_us = elapsed_us(last.sample.t_us, placed.sample.t_us);
                        gaps += ((elapsed_us / period_us).round() as u32).saturating_sub(1);
                    }
                    last = Some(placed);
                    if is_after(from_s) && taken.len() < count {
                        taken.push(placed);
                    }
                }
                if taken.len() == count {
                    // What has arrived since may show that the first of them are older than they seemed.
                    taken.retain(|placed| stream.tie.is_after(placed.t_s, from_s, self.latency_s));
                }
                if taken.len() == count {
                    let mut builder = ReadingBuilder::default();
                    for Placed { sample, .. } in &taken {
                        builder.add(sample.t_us, sample.value, sample.clipped);
                    }
                    let none = || self.error(Cause::NoReadings { asked: count });
                    drop(stream);
                    return builder.finish(gaps).ok_or_else(none);
                }
            }
            if Instant::now() >= until {
                return Err(self.too_late(count));
            }
            self.more(until).await?;
        }
    }
}

#[async_trait]
impl Receiver for FreeRunningReceiver {
    fn device(&self) -> &Device {
        &self.device
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.attempt = "reading a point";
        let asked = Instant::now();
        let asked_s = self.reader.seconds(asked);
        let from_s = asked_s + settle.as_secs_f64();
        let longest_s =
            self.latency_s + settle.as_secs_f64() + count as f64 / self.identity.rate_hz;
        let until = asked + duration(2.0 * longest_s) + QUIET;
        self.reader.stream().begin_keeping();
        let reading = self.average(asked_s, from_s, count, until).await;
        self.reader.stream().end_keeping();
        reading
    }

    async fn record(&mut self, during: DuringRecording<'_>) -> Result<Recording, RigError> {
        self.attempt = "recording while the robot moves";
        if self.lines == Lines::Value {
            // A line that is lost would put all that follow in a wrong place.
            return Err(self.error(Cause::NoRecording));
        }
        let jumps = self.reader.stream().jumps;
        let until = Instant::now() + QUIET;
        while !self.reader.stream().tie.is_steady() {
            if Instant::now() >= until {
                return Err(self.too_late(1));
            }
            self.more(until).await?;
        }
        self.reader.stream().begin_keeping();
        let began_s = self.reader.seconds(Instant::now());
        during.await;
        let ended = Instant::now();
        let ended_s = self.reader.seconds(ended);
        let until = ended + QUIET + duration(self.latency_s);
        loop {
            if self.reader.stream().jumps != jumps {
                return Err(self.error(Cause::Reset));
            }
            if let Some(recording) = self.recorded(began_s, ended_s) {
                return Ok(recording);
            }
            if Instant::now() >= until {
                return Err(self.too_late(1));
            }
            self.more(until).await?;
        }
    }
}
