//! The receiver that samples when it is asked.

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

use super::binary::FrameDecoder;
use super::config::{Encoding, StreamConfig};
use super::protocol::{Event, parse_identity, parse_time};
use super::reading::{Reading, ReceiverIdentity, is_possible_sample};
use super::recording::{DuringRecording, Recorder, Recording};
use super::run::Run;
use super::text::TextDecoder;
use crate::Receiver;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};

/// How long a receiver that starts up may take to its first answer.
const START_WITHIN: Duration = Duration::from_secs(10);

/// How long one answer may take before the question is asked again while starting up.
const ASK_AGAIN_AFTER: Duration = Duration::from_secs(1);

/// Silence after which an answer or the rest of a run is taken for lost.
const QUIET: Duration = Duration::from_secs(2);

/// Silence after which nothing older is under way.
const CAUGHT_UP_AFTER: Duration = Duration::from_millis(250);

/// How long the samples of a recording may still come after it was stopped: a slow line holds them back.
const HELD_BACK: Duration = Duration::from_secs(60);

/// How often a point is asked for before it is given up.
const TRIES: u32 = 3;

/// Noise kept while looking for an answer, bytes.
const LOOKED_AT: usize = 64 * 1024;

/// A receiver behind the protocol of [`super::protocol`].
#[derive(Debug)]
pub struct StreamReceiver<L> {
    wire: Wire<L>,
    identity: ReceiverIdentity,
    encoding: Encoding,
    /// False while answers or a run may be under way: during a call, and after one that was cancelled or missed something.
    idle: bool,
}

impl StreamConfig {
    pub(crate) async fn open(&self, port: Option<&str>) -> Result<Box<dyn Receiver>, RigError> {
        let wire = open_serial(Role::Receiver, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(StreamReceiver::begin(wire, self.encoding).await?))
    }
}

impl<L: ByteLink> StreamReceiver<L> {
    /// Stops any sampling, identifies the receiver, and selects the sample format.
    ///
    /// # Errors
    /// That nothing answers, or not by this protocol.
    pub async fn begin(mut wire: Wire<L>, encoding: Encoding) -> Result<Self, RigError> {
        wire.attempting("identifying the receiver");
        let started = Instant::now();
        let identity = loop {
            if let Some(line) = ask(&mut wire, "X\n?\n", &["receiver "], ASK_AGAIN_AFTER).await? {
                break parse_identity(&line)
                    .ok_or_else(|| wire.error(Cause::Unreadable { seen: line }))?;
            }
            if started.elapsed() >= START_WITHIN {
                return Err(wire.error(Cause::Silent { waited: START_WITHIN }));
            }
        };
        wire.attempting("selecting the sample format");
        let choice = match encoding {
            Encoding::Binary => "E binary\n",
            Encoding::Text => "E text\n",
            Encoding::Iq => "E iq\n",
        };
        match ask(&mut wire, choice, &["ok", "error "], QUIET).await? {
            None => return Err(wire.error(Cause::Silent { waited: QUIET })),
            Some(reply) if reply.starts_with("error ") => {
                return Err(wire.error(Cause::Refused { reply }));
            }
            Some(_) => {}
        }
        let identity = ReceiverIdentity { phase: encoding == Encoding::Iq, ..identity };
        // What was asked before the port was opened may still be answered.
        Ok(Self { wire, identity, encoding, idle: false })
    }

    /// Stops any sampling and reads all that is still to come. Answers to earlier queries come before the answer to this
    /// one; a late answer would be taken for the answer to the next query. False where no answer came.
    async fn catch_up(&mut self) -> Result<bool, RigError> {
        let until = Instant::now() + QUIET;
        if ask(&mut self.wire, "X\nT\n", &["time "], QUIET).await?.is_none() {
            return Ok(false);
        }
        while Instant::now() < until + QUIET {
            if self.wire.bytes(Instant::now() + CAUGHT_UP_AFTER).await?.is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Asks for the time and for samples until further notice. The time, or `None` where the answer was lost.
    async fn begin_recording(&mut self) -> Result<Option<u64>, RigError> {
        self.time_and_samples(0).await
    }

    /// Asks for the time and for so many samples. The time, or `None` where the answer was lost.
    async fn time_and_samples(&mut self, samples: u32) -> Result<Option<u64>, RigError> {
        if !self.idle && !self.catch_up().await? {
            return Ok(None);
        }
        self.idle = false;
        // The receiver's time goes before the samples, so that nothing older can be taken for part of them.
        let question = format!("T\nS {samples}\n");
        let time = ask(&mut self.wire, &question, &["time "], QUIET).await?;
        Ok(time.as_deref().and_then(parse_time))
    }

    /// Takes what comes while `during` runs, then stops the samples and waits for the end mark.
    async fn collect(
        &mut self,
        asked_at_us: u64,
        mut during: DuringRecording<'_>,
    ) -> Result<Recording, RigError> {
        let mut recorder = Recorder::new(asked_at_us, self.identity.rate_hz);
        let mut decoder = Decoder::new(self.encoding, self.identity.full_scale);
        loop {
            let far = Instant::now() + QUIET;
            tokio::select! {
                biased;
                bytes = self.wire.bytes(far) => decoder.push(&bytes?),
                () = &mut during => break,
            }
            while let Some(event) = decoder.next_event() {
                // An end mark here is a stray one: nobody has stopped the samples yet.
                let _ = recorder.take(event);
            }
        }
        let given_up_at = Instant::now() + HELD_BACK;
        let (mut sent, mut silences) = (0, 0);
        while silences < TRIES && Instant::now() < given_up_at {
            self.wire.send(b"X\n").await?;
            sent += 1;
            let until = Instant::now() + QUIET;
            let mut silent = true;
            while Instant::now() < until {
                let bytes = self.wire.bytes(until).await?;
                silent &= bytes.is_empty();
                decoder.push(&bytes);
                while let Some(event) = decoder.next_event() {
                    if let Some(ended_at_us) = recorder.take(event) {
                        // Each further `X` is still to be answered.
                        self.idle = sent == 1;
                        return Ok(recorder.recording(ended_at_us));
                    }
                }
            }
            silences += u32::from(silent);
        }
        let silent = Cause::Silent { waited: TRIES * QUIET };
        Err(self.wire.error(if silences == TRIES {
            silent
        } else {
            Cause::FallenBehind { behind: HELD_BACK }
        }))
    }

    /// One run of samples; `None` where it gave nothing usable.
    async fn run(&mut self, settle: Duration, count: usize) -> Result<Option<Reading>, RigError> {
        let rate_hz = self.identity.rate_hz;
        let samples = Run::samples_for(settle, count, rate_hz);
        let Some(asked_at_us) = self.time_and_samples(samples).await? else {
            return Ok(None);
        };
        let mut run = Run::new(asked_at_us, settle, count, samples, rate_hz);
        let mut decoder = Decoder::new(self.encoding, self.identity.full_scale);
        let period = Duration::try_from_secs_f64(1.0 / rate_hz).unwrap_or(QUIET);
        let until = Instant::now() + 2 * QUIET + period.saturating_mul(samples.saturating_mul(2));
        loop {
            let bytes = self.wire.bytes(until.min(Instant::now() + QUIET + 20 * period)).await?;
            if bytes.is_empty() {
                // The end mark was lost, or the receiver fell silent: what has come is whole as far as it goes.
                return Ok(run.reading());
            }
            decoder.push(&bytes);
            while let Some(event) = decoder.next_event() {
                if run.take(event) {
                    self.idle = true;
                    return Ok(run.reading());
                }
            }
            if Instant::now() >= until {
                return Ok(run.reading());
            }
        }
    }
}

#[async_trait]
impl<L: ByteLink> Receiver for StreamReceiver<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.wire.attempting("reading a point");
        for _ in 0..TRIES {
            if let Some(reading) = self.run(settle, count).await? {
                return Ok(reading);
            }
        }
        Err(self.wire.error(Cause::NoReadings { asked: count }))
    }

    async fn record(&mut self, during: DuringRecording<'_>) -> Result<Recording, RigError> {
        self.wire.attempting("recording while the robot moves");
        for _ in 0..TRIES {
            if let Some(asked_at_us) = self.begin_recording().await? {
                return self.collect(asked_at_us, during).await;
            }
        }
        Err(self.wire.error(Cause::Silent { waited: TRIES * QUIET }))
    }
}

/// Sends a question and looks for its answer, a line that begins with one of `prefixes`.
async fn ask<L: ByteLink>(
    wire: &mut Wire<L>,
    question: &str,
    prefixes: &[&str],
    within: Duration,
) -> Result<Option<String>, RigError> {
    wire.send(question.as_bytes()).await?;
    find_answer(wire, prefixes, Instant::now() + within).await
}

/// Looks for a line that begins with one of `prefixes`, passing over whatever else comes: the rest of an earlier
/// run, frames, noise. What follows the line is left for the next reader.
async fn find_answer<L: ByteLink>(
    wire: &mut Wire<L>,
    prefixes: &[&str],
    until: Instant,
) -> Result<Option<String>, RigError> {
    let mut seen: Vec<u8> = Vec::new();
    loop {
        let more = wire.bytes(until).await?;
        if more.is_empty() {
            return Ok(None);
        }
        seen.extend(more);
        if let Some(answer) = find_line(&seen, prefixes) {
            let rest = seen.split_off(answer.end);
            wire.put_back(rest);
            wire.note_received(&seen[answer.start..]);
            return Ok(Some(String::from_utf8_lossy(&seen[answer.start..]).trim().to_owned()));
        }
        if seen.len() > LOOKED_AT {
            // Whatever was asked has been answered long before so much noise.
            return Ok(None);
        }
    }
}

/// Where the first whole line is that begins with one of `prefixes`; it may follow upon bytes without a line end.
fn find_line(seen: &[u8], prefixes: &[&str]) -> Option<std::ops::Range<usize>> {
    let begins =
        |at: usize| prefixes.iter().any(|prefix| seen[at..].starts_with(prefix.as_bytes()));
    let start = (0..seen.len()).find(|&at| begins(at))?;
    let length = seen[start..].iter().position(|&byte| byte == b'\n')?;
    Some(start..start + length + 1)
}

/// The decoder of the chosen encoding.
#[derive(Debug)]
enum Format {
    Text(TextDecoder),
    Binary(FrameDecoder),
}

/// Finds the events among the bytes of a receiver.
#[derive(Debug)]
struct Decoder {
    format: Format,
    full_scale: f64,
}

impl Decoder {
    fn new(encoding: Encoding, full_scale: f64) -> Self {
        let format = match encoding {
            Encoding::Text => Format::Text(TextDecoder::default()),
            Encoding::Binary | Encoding::Iq => Format::Binary(FrameDecoder::default()),
        };
        Self { format, full_scale }
    }

    fn push(&mut self, bytes: &[u8]) {
        match &mut self.format {
            Format::Text(decoder) => decoder.push(bytes),
            Format::Binary(decoder) => decoder.push(bytes),
        }
    }

    /// The next event. A sample with a value that the receiver cannot give is passed over, and so counts as lost.
    fn next_event(&mut self) -> Option<Event> {
        loop {
            let event = match &mut self.format {
                Format::Text(decoder) => decoder.next_event(),
                Format::Binary(decoder) => decoder.next_event(),
            }?;
            match event {
                Event::Sample(sample) if !is_possible_sample(&sample, self.full_scale) => {}
                _ => return Some(event),
            }
        }
    }
}

#[cfg(test)]
mod tests;
