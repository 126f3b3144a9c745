//! The receiver that streams without being asked.
//!
//! It sends lines `<t_us> <value>`, with ` !` behind it where it clipped, or plain numbers, or frames, without end, and takes no
//! commands. A line that arrives now may have been waiting in buffers since before the robot stood still. So what has
//! already arrived is discarded, and so is what follows for as long as `latency_ms`.

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

use super::binary::FrameDecoder;
use super::config::{FreeRunningConfig, Lines};
use super::protocol::Event;
use super::reading::{Reading, ReadingBuilder, ReceiverIdentity};
use super::recording::{DuringRecording, Recording, TimedSample};
use crate::Receiver;
use crate::config::ReceiverConfig;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};

/// Silence after which the receiver is taken for lost.
const QUIET: Duration = Duration::from_secs(5);

/// A pause this long means that nothing is left in the buffers.
const PAUSE: Duration = Duration::from_millis(1);

/// Reading for this long empties any buffer, whose bytes come faster than new ones.
const DRAINED_AFTER: Duration = Duration::from_millis(50);

/// Two lines further apart than this many periods have a damaged time between them, or a restart.
const MOST_PERIODS: f64 = 50.0;

/// Samples in a row with a time that cannot be, after which their time is accepted.
const MOST_IMPLAUSIBLE: u32 = 3;

/// A receiver that streams lines without being asked.
#[derive(Debug)]
pub struct FreeRunningReceiver<L> {
    wire: Wire<L>,
    identity: ReceiverIdentity,
    latency: Duration,
    lines: Lines,
    column: usize,
    frames: FrameDecoder,
    /// Samples without a time of their own that were read so far.
    counted: u64,
}

impl FreeRunningConfig {
    pub(crate) async fn open(
        &self,
        _: &ReceiverConfig,
        port: Option<&str>,
    ) -> Result<Box<dyn Receiver>, RigError> {
        let wire = open_serial(Role::Receiver, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(FreeRunningReceiver::begin(wire, self).await?))
    }
}

impl<L: ByteLink> FreeRunningReceiver<L> {
    /// Waits for the first line that is a sample.
    ///
    /// # Errors
    /// That nothing comes, or nothing that is a sample.
    pub async fn begin(wire: Wire<L>, config: &FreeRunningConfig) -> Result<Self, RigError> {
        let mut receiver = Self {
            wire,
            identity: ReceiverIdentity {
                rate_hz: config.rate_hz.get(),
                full_scale: config.full_scale.get(),
                unit: config.unit.clone(),
                own_clock: config.lines != Lines::Value,
            },
            latency: Duration::try_from_secs_f64(config.latency_ms.get() * 1e-3).unwrap_or(QUIET),
            lines: config.lines,
            column: config.column.get(),
            frames: FrameDecoder::default(),
            counted: 0,
        };
        receiver.wire.attempting("waiting for the first sample");
        receiver.next_sample(Instant::now() + QUIET).await?;
        Ok(receiver)
    }

    /// Throws away what has arrived so far, up to the end of the line that is arriving.
    async fn drain(&mut self) -> Result<(), RigError> {
        let until = Instant::now() + DRAINED_AFTER;
        while Instant::now() < until {
            if self.wire.bytes(Instant::now() + PAUSE).await?.is_empty() {
                break;
            }
        }
        if self.lines == Lines::Frames {
            // A frame that lost its beginning is passed over by its decoder.
            self.frames = FrameDecoder::default();
            return Ok(());
        }
        // The first line may have lost its beginning.
        self.wire.line(Instant::now() + QUIET).await.map(drop)
    }

    async fn next_frame(&mut self, until: Instant) -> Result<Sample, RigError> {
        loop {
            if let Some(event) = self.frames.next_event() {
                let Event::Sample(sample) = event else { continue };
                if sample.value.is_finite() {
                    let clipped = sample.clipped || sample.value.abs() >= self.identity.full_scale;
                    return Ok(Sample { t_us: sample.t_us, value: sample.value, clipped });
                }
            } else {
                let bytes = self.wire.bytes(until.min(Instant::now() + QUIET)).await?;
                if bytes.is_empty() {
                    return Err(self.wire.error(Cause::Silent { waited: QUIET }));
                }
                self.frames.push(&bytes);
            }
            if Instant::now() >= until {
                let seen = "no frame among the bytes".to_owned();
                return Err(self.wire.error(Cause::Unreadable { seen }));
            }
        }
    }

    /// Makes sense of a line.
    fn sample_in(&mut self, line: &str) -> Option<Sample> {
        let full_scale = self.identity.full_scale;
        if self.lines == Lines::TimeAndValue {
            return parse(line, full_scale);
        }
        let value = number_in(line, self.column)?;
        self.counted += 1;
        let t_us = (self.counted as f64 * 1e6 / self.identity.rate_hz).round() as u64;
        Some(Sample { t_us, value, clipped: value.abs() >= full_scale })
    }

    async fn next_sample(&mut self, until: Instant) -> Result<Sample, RigError> {
        if self.lines == Lines::Frames {
            return self.next_frame(until).await;
        }
        let mut line_until = until;
        loop {
            line_until = line_until.min(Instant::now() + QUIET);
            match self.wire.line(line_until).await? {
                Some(line) => match self.sample_in(&line) {
                    Some(sample) => return Ok(sample),
                    None if Instant::now() >= until => {
                        return Err(self.wire.error(Cause::Unreadable { seen: line }));
                    }
                    None => {}
                },
                None => return Err(self.wire.error(Cause::Silent { waited: QUIET })),
            }
        }
    }
}

#[async_trait]
impl<L: ByteLink> Receiver for FreeRunningReceiver<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.wire.attempting("reading a point");
        let period_us = 1e6 / self.identity.rate_hz;
        let untrusted_us = (self.latency.saturating_add(settle)).as_secs_f64() * 1e6;
        let longest_us = (untrusted_us + period_us * count as f64) * 2.0;
        let longest = Duration::try_from_secs_f64(longest_us * 1e-6).unwrap_or(QUIET);
        self.drain().await?;
        let until = Instant::now() + longest + QUIET;
        let mut tally = ReadingBuilder::default();
        let mut gaps = 0;
        let mut since_first_us = 0.0;
        let mut last: Option<Sample> = None;
        while tally.count() < count {
            if Instant::now() >= until {
                return Err(self.wire.error(Cause::NoReadings { asked: count }));
            }
            let sample = self.next_sample(until).await?;
            let periods = last.map_or(1.0, |last| elapsed_us(last.t_us, sample.t_us) / period_us);
            if periods > 0.2 && periods < MOST_PERIODS {
                since_first_us += last.map_or(0.0, |last| elapsed_us(last.t_us, sample.t_us));
                gaps += (periods.round() as u32).saturating_sub(1);
            } else {
                // A damaged time: begin again from here, which only errs to the late side.
                (since_first_us, gaps, tally) = (0.0, 0, ReadingBuilder::default());
            }
            last = Some(sample);
            if since_first_us >= untrusted_us {
                tally.add(sample.t_us, sample.value, sample.clipped);
            }
        }
        tally.finish(gaps).ok_or_else(|| self.wire.error(Cause::NoReadings { asked: count }))
    }

    /// Its clock is known from its samples alone, so both ends are late by the latency of the samples.
    async fn record(&mut self, mut during: DuringRecording<'_>) -> Result<Recording, RigError> {
        self.wire.attempting("recording while the robot moves");
        if self.lines == Lines::Value {
            // A line that is lost would put all that follow in a wrong place.
            return Err(self.wire.error(Cause::NoRecording));
        }
        self.drain().await?;
        let first = self.next_sample(Instant::now() + QUIET).await?;
        let mut track = Track::from(first, 1e6 / self.identity.rate_hz);
        loop {
            tokio::select! {
                biased;
                sample = self.next_sample(Instant::now() + QUIET) => track.take(sample?),
                () = &mut during => break,
            }
        }
        let (began_s, ended_s) = (track.samples[0].t_s, track.now_s());
        let until = Instant::now() + QUIET + self.latency;
        while track.now_s() < ended_s + self.latency.as_secs_f64() {
            track.take(self.next_sample(until).await?);
        }
        Ok(Recording { began_s, ended_s, samples: track.samples })
    }
}

/// The samples of a recording, their clock unwrapped.
struct Track {
    samples: Vec<TimedSample>,
    last: Sample,
    period_us: f64,
    implausible: u32,
}

impl Track {
    fn from(first: Sample, period_us: f64) -> Self {
        let Sample { t_us, value, clipped } = first;
        let samples = vec![TimedSample { t_s: t_us as f64 * 1e-6, value, clipped }];
        Self { samples, last: first, period_us, implausible: 0 }
    }

    fn now_s(&self) -> f64 {
        self.samples[self.samples.len() - 1].t_s
    }

    /// Takes a sample, unless its time is damaged; after a few such it is the one before that was.
    fn take(&mut self, sample: Sample) {
        let elapsed_us = elapsed_us(self.last.t_us, sample.t_us);
        let plausible = (0.2..MOST_PERIODS).contains(&(elapsed_us / self.period_us));
        if !plausible && self.implausible < MOST_IMPLAUSIBLE {
            self.implausible += 1;
            return;
        }
        let passed_us = if plausible { elapsed_us } else { self.period_us };
        let t_s = self.now_s() + passed_us * 1e-6;
        self.samples.push(TimedSample { t_s, value: sample.value, clipped: sample.clipped });
        self.implausible = 0;
        self.last = sample;
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    t_us: u64,
    value: f64,
    clipped: bool,
}

fn parse(line: &str, full_scale: f64) -> Option<Sample> {
    let mut words = line.split_ascii_whitespace();
    let t_us = words.next()?.parse().ok()?;
    let value = words.next()?.parse().ok().filter(|value: &f64| value.is_finite())?;
    let marked = match words.next() {
        None => false,
        Some("!") => true,
        Some(_) => return None,
    };
    words.next().is_none().then_some(Sample {
        t_us,
        value,
        clipped: marked || value.abs() >= full_scale,
    })
}

/// The number at a place, from 1, among those of a line; what is no number beside them is passed over.
fn number_in(line: &str, column: usize) -> Option<f64> {
    line.split([',', ';', ':', '=', ' ', '\t'])
        .filter_map(|word| word.parse().ok())
        .filter(|value: &f64| value.is_finite())
        .nth(column - 1)
}

/// Time from one stamp to a later one, µs. Clocks of 32 bits wrap after 72 minutes.
fn elapsed_us(from_us: u64, to_us: u64) -> f64 {
    match (u32::try_from(from_us), u32::try_from(to_us)) {
        (Ok(from), Ok(to)) => f64::from(to.wrapping_sub(from)),
        _ => to_us as f64 - from_us as f64,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tokio::io::{AsyncWriteExt, duplex};

    use super::*;
    use fieldgap_input::{NonNegative, Positive};

    fn config() -> FreeRunningConfig {
        FreeRunningConfig {
            port: None,
            baud: 115_200,
            lines: Lines::TimeAndValue,
            column: std::num::NonZeroUsize::MIN,
            rate_hz: Positive::new(1000.0).expect("positive"),
            unit: "V".into(),
            full_scale: Positive::new(5.0).expect("positive"),
            latency_ms: NonNegative::new(10.0).expect("not negative"),
        }
    }

    /// Streams a sample each millisecond whose value is its own number; skips those in `lost`.
    async fn bench(
        first_us: u64,
        lost: std::ops::Range<u64>,
    ) -> FreeRunningReceiver<tokio::io::DuplexStream> {
        let (near, mut far) = duplex(64 * 1024);
        tokio::spawn(async move {
            for k in 0.. {
                tokio::time::sleep(Duration::from_millis(1)).await;
                let t_us = (first_us + k * 1000) % (1 << 32);
                let line = format!("{t_us} {k}{}\n", if k > 4 { "" } else { " !" });
                if !lost.contains(&k) && far.write_all(line.as_bytes()).await.is_err() {
                    return;
                }
            }
        });
        let mut config = config();
        config.full_scale = Positive::new(1e9).expect("positive");
        FreeRunningReceiver::begin(Wire::new(near, Device::new(Role::Receiver, "memory")), &config)
            .await
            .expect("samples come")
    }

    #[tokio::test(start_paused = true)]
    async fn what_is_heard_during_a_move_is_recorded_though_the_clock_wraps() {
        let mut receiver = bench((1 << 32) - 300_000, 400..410).await;
        let going = tokio::time::sleep(Duration::from_millis(500));
        let recording = receiver.record(Box::pin(going)).await.expect("samples come");
        let lasted_s = recording.ended_s - recording.began_s;
        assert!((lasted_s - 0.5).abs() < 5e-3, "{lasted_s}");
        let (first, last) =
            (&recording.samples[0], &recording.samples[recording.samples.len() - 1]);
        assert!((last.t_s - recording.ended_s - 0.010).abs() < 2e-3);
        // A value is a sample's number: as many milliseconds have passed.
        assert!(((last.t_s - first.t_s) * 1e3 - (last.value - first.value)).abs() < 1e-6);
        assert_eq!(recording.samples.len(), (last.value - first.value) as usize + 1 - 10);
    }

    #[tokio::test(start_paused = true)]
    async fn a_damaged_time_in_a_recording_costs_that_sample() {
        let sample = |t_us: u64| Sample { t_us, value: 1.0, clipped: false };
        let mut track = Track::from(sample(5_000_000), 1000.0);
        for t_us in [5_001_000, 9_002_000, 5_003_000, 5_004_000] {
            track.take(sample(t_us));
        }
        let times: Vec<f64> = track.samples.iter().map(|sample| sample.t_s).collect();
        assert!(
            times.iter().zip([5.0, 5.001, 5.003, 5.004]).all(|(a, b)| (a - b).abs() < 1e-9),
            "{times:?}"
        );
    }

    #[tokio::test(start_paused = true)]
    async fn what_arrived_before_the_question_is_thrown_away() {
        let mut receiver = bench(0, 0..0).await;
        tokio::time::sleep(Duration::from_millis(500)).await;
        let reading =
            receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
        // 500 ms have gone by, and 30 ms of latency and settling follow.
        assert!(reading.mean >= 530.0, "{reading:?}");
        assert_eq!((reading.count, reading.gaps, reading.clipped), (16, 0, false));
        assert!(
            (reading.std - (16.0_f64 * 17.0 / 12.0).sqrt()).abs() < 1e-9,
            "16 numbers in a row"
        );
    }

    /// Streams what `sample` makes of each number, one each millisecond.
    async fn logger(
        lines: Lines,
        column: usize,
        sample: impl Fn(u64) -> Vec<u8> + Send + 'static,
    ) -> FreeRunningReceiver<tokio::io::DuplexStream> {
        let (near, mut far) = duplex(64 * 1024);
        tokio::spawn(async move {
            for k in 0.. {
                tokio::time::sleep(Duration::from_millis(1)).await;
                if far.write_all(&sample(k)).await.is_err() {
                    return;
                }
            }
        });
        let column = std::num::NonZeroUsize::new(column).expect("from 1");
        let full_scale = Positive::new(1e9).expect("positive");
        let config = FreeRunningConfig { lines, column, full_scale, ..config() };
        FreeRunningReceiver::begin(Wire::new(near, Device::new(Role::Receiver, "memory")), &config)
            .await
            .expect("samples come")
    }

    #[tokio::test(start_paused = true)]
    async fn a_logger_that_only_prints_numbers_is_read() {
        let line = |k: u64| format!("A0: {k}, A1: 7\r\n").into_bytes();
        let mut receiver = logger(Lines::Value, 1, line).await;
        tokio::time::sleep(Duration::from_millis(500)).await;
        let reading =
            receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
        assert!(reading.mean >= 530.0, "{reading:?}");
        assert!((reading.last_t_s - reading.first_t_s - 0.015).abs() < 1e-9);
        assert_eq!((reading.count, receiver.identity().own_clock), (16, false));
        let refused = receiver.record(Box::pin(std::future::ready(()))).await;
        assert!(matches!(refused.expect_err("it has no times").cause(), Cause::NoRecording));
        let mut second = logger(Lines::Value, 2, line).await;
        assert_eq!(second.read_point(Duration::ZERO, 3).await.expect("samples come").mean, 7.0);
    }

    #[tokio::test(start_paused = true)]
    async fn frames_that_nobody_asked_for_are_read() {
        use super::super::binary::tests::frame;
        let sample = |k: u64| match k % 7 {
            // One in seven is damaged.
            3 => frame(1, 0, k as u32, k * 1000, k as f32)[5..].to_vec(),
            _ => frame(1, 0, k as u32, k * 1000, k as f32),
        };
        let mut receiver = logger(Lines::Frames, 1, sample).await;
        tokio::time::sleep(Duration::from_millis(500)).await;
        let reading =
            receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
        assert!(reading.mean >= 530.0 && reading.gaps > 3, "{reading:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn lost_lines_are_gaps() {
        let mut receiver = bench(0, 20..24).await;
        let reading =
            receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
        assert_eq!(reading.gaps, 4);
    }

    #[tokio::test(start_paused = true)]
    async fn a_clock_of_32_bits_may_wrap() {
        let mut receiver = bench((1 << 32) - 30_000, 0..0).await;
        let reading =
            receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
        assert_eq!((reading.count, reading.gaps), (16, 0));
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_receiver_is_named() {
        let (near, _far) = duplex(64);
        let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
        let error = FreeRunningReceiver::begin(wire, &config()).await.expect_err("silent");
        assert!(
            error.to_string().starts_with("receiver on memory, waiting for the first sample"),
            "{error}"
        );
    }

    #[test]
    fn a_value_at_full_scale_is_clipped() {
        assert_eq!(parse("12 -5.0", 5.0), Some(Sample { t_us: 12, value: -5.0, clipped: true }));
        assert_eq!(parse("12 4.9", 5.0), Some(Sample { t_us: 12, value: 4.9, clipped: false }));
        for bad in ["12", "x 1", "12 nan", "12 1 ?", "12 1 ! 3"] {
            assert_eq!(parse(bad, 5.0), None, "{bad}");
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_the_parser_panic(line in "\\PC{0,40}") {
            let _ = parse(&line, 5.0);
            let _ = number_in(&line, 2);
        }
    }
}
