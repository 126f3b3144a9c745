//! A complete driver: a receiver behind a voltmeter that speaks a text protocol.
//!
//! | line | answer |
//! |---|---|
//! | `RANGE?` | `range 5.0 V`: the voltage at which it clips |
//! | `READ?` | `read 0.412 V` |
//!
//! Run it with `cargo run -p fieldgap-rig --example write_a_driver`. The voltmeter at the other end of the link is a
//! few lines of code here. With hardware, `link::open_serial` or `link::open_tcp` gives the link instead.
//!
//! What a driver has to take care of:
//!
//! - Each wait has a limit, and each error names the device and the attempt. `Wire` does most of it.
//! - A call may be cancelled at any `await`. So each query first discards what an earlier one left behind.
//! - No reading is older than the call. Here each value is requested after the settling time.

use std::time::Duration;

use async_trait::async_trait;
use fieldgap_rig::link::{ByteLink, Wire};
use fieldgap_rig::receiver::ReadingBuilder;
use fieldgap_rig::{Cause, Device, Reading, Receiver, ReceiverIdentity, RigError, Role};
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};
use tokio::time::{Instant, sleep};

/// How long one answer may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(1);

/// The driver. It works on any link: a serial port, a socket, a pipe in memory.
struct Voltmeter<L> {
    wire: Wire<L>,
    identity: ReceiverIdentity,
    opened: Instant,
}

impl<L: ByteLink> Voltmeter<L> {
    /// Identifies the instrument and measures how fast it answers.
    async fn begin(wire: Wire<L>) -> Result<Self, RigError> {
        let unknown = ReceiverIdentity {
            rate_hz: 1.0,
            full_scale: 0.0,
            unit: "V".to_owned(),
            // It sends no times, so those of this machine are used.
            own_clock: false,
            phase: false,
        };
        let mut voltmeter = Self { wire, identity: unknown, opened: Instant::now() };
        voltmeter.wire.attempting("identifying the voltmeter");
        voltmeter.identity.full_scale = voltmeter.query("RANGE?", "range ").await?;
        let asked = Instant::now();
        voltmeter.query("READ?", "read ").await?;
        voltmeter.identity.rate_hz = 1.0 / asked.elapsed().as_secs_f64().max(1e-3);
        Ok(voltmeter)
    }

    /// Sends a query and reads the voltage in its answer, V.
    async fn query(&mut self, query: &str, prefix: &str) -> Result<f64, RigError> {
        // The late answer to a cancelled query.
        while !self.wire.bytes(Instant::now()).await?.is_empty() {}
        self.wire.send(format!("{query}\n").as_bytes()).await?;
        let Some(line) = self.wire.line(Instant::now() + ANSWER_WITHIN).await? else {
            return Err(self.wire.error(Cause::Silent { waited: ANSWER_WITHIN }));
        };
        let number = line.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(" V"));
        let volts = number.and_then(|number| number.parse().ok()).filter(|v: &f64| v.is_finite());
        volts.ok_or_else(|| self.wire.error(Cause::Unreadable { seen: line }))
    }
}

#[async_trait]
impl<L: ByteLink> Receiver for Voltmeter<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.wire.attempting("reading a point");
        sleep(settle).await;
        let mut reading = ReadingBuilder::default();
        for _ in 0..count {
            let volts = self.query("READ?", "read ").await?;
            let t_us = self.opened.elapsed().as_micros() as u64;
            reading.add(t_us, volts, volts >= self.identity.full_scale);
        }
        reading.finish(0).ok_or_else(|| self.wire.error(Cause::NoReadings { asked: count }))
    }
}

/// The voltmeter itself: reads 0.40 V and 0.42 V by turns, and falls silent after so many answers.
async fn instrument(link: DuplexStream, answers: usize) {
    let mut link = BufReader::new(link);
    let mut line = String::new();
    for number in 0..answers {
        line.clear();
        if !link.read_line(&mut line).await.is_ok_and(|bytes| bytes > 0) {
            return;
        }
        let answer = match line.trim() {
            "RANGE?" => "range 5.0 V\n",
            "READ?" if number % 2 == 0 => "read 0.40 V\n",
            "READ?" => "read 0.42 V\n",
            _ => "error\n",
        };
        if link.get_mut().write_all(answer.as_bytes()).await.is_err() {
            return;
        }
    }
    // The link stays open until the driver closes it.
    while link.read_line(&mut line).await.is_ok_and(|bytes| bytes > 0) {}
}

/// The driver, connected to an instrument in memory.
async fn open(answers: usize) -> Result<Voltmeter<DuplexStream>, RigError> {
    let (near, far) = duplex(256);
    tokio::spawn(instrument(far, answers));
    Voltmeter::begin(Wire::new(near, Device::new(Role::Receiver, "memory"))).await
}

#[tokio::main]
async fn main() -> Result<(), RigError> {
    // As a trait object, as `SafeRig::new` takes it beside a robot and an array.
    let mut receiver: Box<dyn Receiver> = Box::new(open(usize::MAX).await?);
    let identity = receiver.identity().clone();
    println!("{}, full scale {} {}", receiver.device(), identity.full_scale, identity.unit);
    let reading = receiver.read_point(Duration::from_millis(20), 16).await?;
    println!("{:.3} ± {:.3} {} of {}", reading.mean, reading.std, identity.unit, reading.count);

    // An instrument that falls silent: the error names the device, the attempt and what was seen.
    let mut silent = open(4).await?;
    if let Err(error) = silent.read_point(Duration::ZERO, 16).await {
        println!("{error}\nhelp: {}", error.remedy());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_point_is_the_mean_of_its_readings() {
        let mut voltmeter = open(usize::MAX).await.expect("it answers");
        let reading =
            voltmeter.read_point(Duration::from_millis(20), 16).await.expect("it answers");
        assert!((reading.mean - 0.41).abs() < 1e-12, "{reading:?}");
        assert_eq!((reading.count, reading.clipped), (16, false));
    }

    #[tokio::test(start_paused = true)]
    async fn an_instrument_that_falls_silent_is_an_error() {
        let mut voltmeter = open(4).await.expect("it answers");
        let error = voltmeter.read_point(Duration::ZERO, 16).await.expect_err("silent");
        assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
    }
}
