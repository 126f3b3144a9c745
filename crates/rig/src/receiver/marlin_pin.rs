//! An analog pin of a board with Marlin's firmware: the receiver's level on a thermistor input.
//!
//! `M43 P<pin>` (firmware built with `PINS_DEBUGGING`) answers `Analog in = <counts>` among other text, then `ok`. A sensor that the
//! firmware reads itself is asked for otherwise (`query = "M105"`, `value_after = "T:"`). The board is on a port of its own: the
//! robot's own board through its second serial port (`SERIAL_PORT_2` in its firmware), or another one. The robot's own port is
//! taken by the robot.

use std::time::Duration;

use async_trait::async_trait;
use serde::Deserialize;
use tokio::time::{Instant, sleep};

use super::reading::{Reading, ReadingBuilder, ReceiverIdentity, is_possible};
use crate::Receiver;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};
use fieldgap_input::Positive;

/// How long one answer may take.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);

/// How often a starting board is asked: opening its port resets many.
const TRIES_AT_START: u32 = 6;

/// What marks begin with. The firmware echoes them (`M118`), or repeats them as an unknown command.
const MARK: &str = "fieldgap-pin-";

/// `[receiver.marlin_pin]`: which pin, and what its counts mean.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarlinPinConfig {
    /// The serial port; absent where a virtual rig gives it.
    port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    baud: u32,
    /// The pin, by the firmware's number.
    pin: u16,
    /// Asks for its value; `{pin}` stands for its number.
    #[serde(default = "default_query")]
    query: String,
    /// What stands before the value in the answer.
    #[serde(default = "default_value_after")]
    value_after: String,
    /// The value at full scale.
    #[serde(default = "ten_bits")]
    full_scale_counts: Positive,
    /// The reading at full scale, in `unit`.
    #[serde(default = "five_volts")]
    full_scale: Positive,
    /// Unit of the readings.
    #[serde(default = "volts")]
    unit: String,
}

fn default_baud() -> u32 {
    115_200
}

fn default_query() -> String {
    "M43 P{pin}".to_owned()
}

fn default_value_after() -> String {
    "Analog in =".to_owned()
}

fn ten_bits() -> Positive {
    Positive::new(1023.0).expect("a literal above zero")
}

fn five_volts() -> Positive {
    Positive::new(5.0).expect("a literal above zero")
}

fn volts() -> String {
    "V".to_owned()
}

impl MarlinPinConfig {
    pub(crate) async fn open(&self, port: Option<&str>) -> Result<Box<dyn Receiver>, RigError> {
        let wire = open_serial(Role::Receiver, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(MarlinPinReceiver::begin(wire, self).await?))
    }
}

/// A pin that is asked for its value again and again.
#[derive(Debug)]
pub struct MarlinPinReceiver<L> {
    wire: Wire<L>,
    identity: ReceiverIdentity,
    query: String,
    value_after: String,
    full_scale_counts: f64,
    began: Instant,
    /// False while a late answer to an earlier query may still arrive.
    in_step: bool,
    /// The last mark; no two of a session are alike.
    mark: u64,
    /// Whether this board echoes marks; not known before the first.
    echoes_marks: Option<bool>,
}

impl<L: ByteLink> MarlinPinReceiver<L> {
    /// Asks for the pin until the board has started.
    ///
    /// # Errors
    /// That nothing answers, or that the firmware does not report the pin's value.
    pub async fn begin(wire: Wire<L>, config: &MarlinPinConfig) -> Result<Self, RigError> {
        // The openings before this one may have left answers on their way.
        let mark = u64::from(wire.opening()) << 32;
        let mut receiver = Self {
            wire,
            identity: ReceiverIdentity {
                rate_hz: 1.0,
                full_scale: config.full_scale.get(),
                unit: config.unit.clone(),
                own_clock: false,
                phase: false,
            },
            query: config.query.replace("{pin}", &config.pin.to_string()),
            value_after: config.value_after.clone(),
            full_scale_counts: config.full_scale_counts.get(),
            began: Instant::now(),
            in_step: false,
            mark,
            echoes_marks: None,
        };
        receiver.wire.attempting("reading the pin");
        let mut tries = 1;
        loop {
            match receiver.value().await {
                Err(error)
                    if matches!(error.cause(), Cause::Silent { .. }) && tries < TRIES_AT_START =>
                {
                    tries += 1;
                }
                Err(error) => return Err(error),
                Ok(_) => break,
            }
        }
        let asked = Instant::now();
        receiver.value().await?;
        receiver.identity.rate_hz = 1.0 / asked.elapsed().as_secs_f64().max(1e-3);
        Ok(receiver)
    }

    /// Lets all answers to earlier queries pass: behind an echoed mark none is left. A board that echoes no mark is waited for
    /// until it has been silent as long as one answer may take.
    async fn get_in_step(&mut self) -> Result<(), RigError> {
        if self.echoes_marks != Some(false) {
            self.mark += 1;
            let mark = format!("{MARK}{}", self.mark);
            self.wire.send(format!("M118 {mark}\n").as_bytes()).await?;
            let (mut marked, mut answered) = (false, false);
            while let Some(line) = self.wire.line(Instant::now() + ANSWER_WITHIN).await? {
                marked |= line.trim_end_matches('"').ends_with(&mark);
                answered |= is_ok(&line);
                if marked && is_ok(&line) {
                    self.echoes_marks = Some(true);
                    return Ok(());
                }
            }
            match self.echoes_marks {
                Some(_) => return Err(self.wire.error(Cause::Silent { waited: ANSWER_WITHIN })),
                None if answered => self.echoes_marks = Some(false),
                // A board that has not started yet.
                None => {}
            }
            return Ok(());
        }
        let until = Instant::now() + 2 * ANSWER_WITHIN;
        while Instant::now() < until
            && !self.wire.bytes(Instant::now() + ANSWER_WITHIN).await?.is_empty()
        {}
        Ok(())
    }

    /// The pin's value now, in counts.
    async fn value(&mut self) -> Result<f64, RigError> {
        if !self.in_step {
            self.get_in_step().await?;
        }
        self.in_step = false;
        self.wire.send(format!("{}\n", self.query).as_bytes()).await?;
        let until = Instant::now() + ANSWER_WITHIN;
        let (mut value, mut refusal) = (None, None);
        while let Some(line) = self.wire.line(until).await? {
            value = value.or_else(|| value_in(&line, &self.value_after));
            if line.contains("nknown command") || line.contains("protected") {
                refusal = Some(line.clone());
            }
            if is_ok(&line) {
                self.in_step = true;
                if let Some(counts) = value.filter(|c| !is_possible(*c, self.full_scale_counts)) {
                    let seen =
                        format!("{counts} counts from a converter of {}", self.full_scale_counts);
                    return Err(self.wire.error(Cause::Unreadable { seen }));
                }
                let cause = match refusal {
                    Some(reply) => Cause::Refused { reply },
                    None => Cause::Unreadable { seen: line },
                };
                return value.ok_or_else(|| self.wire.error(cause));
            }
        }
        Err(self.wire.error(Cause::Silent { waited: ANSWER_WITHIN }))
    }
}

/// Whether a line acknowledges a command.
fn is_ok(line: &str) -> bool {
    line == "ok" || line.starts_with("ok ")
}

/// The number after a mark in a line.
fn value_in(line: &str, mark: &str) -> Option<f64> {
    let (_, after) = line.split_once(mark)?;
    let word = after.split_ascii_whitespace().next()?;
    let end = word.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+')));
    word[..end.unwrap_or(word.len())].parse().ok()
}

#[async_trait]
impl<L: ByteLink> Receiver for MarlinPinReceiver<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    /// The board sends no times: `settle` is measured by this machine, and each value is requested after it.
    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.wire.attempting("reading a point");
        sleep(settle).await;
        let mut tally = ReadingBuilder::default();
        for _ in 0..count {
            let counts = self.value().await?;
            let asked_us = self.began.elapsed().as_secs_f64() * 1e6;
            let share = counts / self.full_scale_counts;
            tally.add(asked_us.round() as u64, share * self.identity.full_scale, share >= 1.0);
        }
        tally.finish(0).ok_or_else(|| self.wire.error(Cause::NoReadings { asked: count }))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use proptest::prelude::*;
    use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};

    use super::super::held_link::held_link;
    use super::*;
    use fieldgap_input::toml_text;

    async fn opened(
        keys: &str,
        answer: &'static str,
    ) -> Result<MarlinPinReceiver<DuplexStream>, RigError> {
        let (near, far) = duplex(4096);
        tokio::spawn(async move {
            let mut far = BufReader::new(far);
            let mut line = String::new();
            far.get_mut().write_all(b"start\necho:Marlin 2.1.2\n").await.expect("room");
            while far.read_line(&mut line).await.is_ok_and(|count| count > 0) {
                let answer = answer.replace("{}", line.trim());
                line.clear();
                if far.get_mut().write_all(answer.as_bytes()).await.is_err() {
                    return;
                }
            }
        });
        let config: MarlinPinConfig =
            toml_text(std::path::Path::new("rig.toml"), keys).expect("a valid table");
        let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
        MarlinPinReceiver::begin(wire, &config).await
    }

    const PIN: &str =
        "PIN: 57   Port: F3   A3  <unused/unknown>   Analog in =   341   Input  = 1\nok\n";

    #[tokio::test(start_paused = true)]
    async fn counts_become_volts() {
        let mut receiver = opened("pin = 57", PIN).await.expect("it answers");
        let reading = receiver.read_point(Duration::from_millis(5), 4).await.expect("it answers");
        assert!((reading.mean - 5.0 * 341.0 / 1023.0).abs() < 1e-12);
        assert_eq!((reading.count, reading.clipped, reading.std), (4, false, 0.0));
    }

    #[tokio::test(start_paused = true)]
    async fn a_sensor_that_the_firmware_reads_is_asked_for_otherwise() {
        let keys = "pin = 0\nquery = \"M105\"\nvalue_after = \"T:\"\nfull_scale_counts = 300.0\nfull_scale = 300.0\nunit = \"degC\"";
        let mut receiver =
            opened(keys, "ok T:21.50 /0.00 B:20.1 /0.0\n").await.expect("it answers");
        let reading = receiver.read_point(Duration::ZERO, 1).await.expect("it answers");
        assert!((reading.mean - 21.5).abs() < 1e-12);
    }

    #[tokio::test(start_paused = true)]
    async fn a_pin_at_full_scale_is_clipped() {
        let mut receiver = opened("pin = 57", "Analog in = 1023\nok\n").await.expect("it answers");
        assert!(receiver.read_point(Duration::ZERO, 1).await.expect("it answers").clipped);
    }

    #[tokio::test(start_paused = true)]
    async fn counts_beyond_the_converter_are_an_error() {
        let error = opened("pin = 57", "Analog in = 34100\nok\n").await.expect_err("10 bits");
        assert!(matches!(error.cause(), Cause::Unreadable { .. }), "{error}");
    }

    #[tokio::test(start_paused = true)]
    async fn firmware_without_the_command_is_reported_with_its_reply() {
        let unknown = "echo:Unknown command: \"{}\"\nok\n";
        let error = opened("pin = 57", unknown).await.expect_err("it is not built so");
        assert!(matches!(error.cause(), Cause::Refused { .. }));
        assert!(error.to_string().contains("M43 P57"), "{error}");
        let error = opened("pin = 57", "echo:busy\n").await.expect_err("no ok");
        assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
    }

    /// A board that counts its answers, one a query, whose answers are held back and then come in slices.
    #[tokio::test(start_paused = true)]
    async fn a_late_answer_is_not_taken_for_the_next_ones() {
        for echoes in [true, false] {
            for pause_ms in [5, 100, 900] {
                let (near, far) = duplex(4096);
                let asked = Arc::new(AtomicU32::new(0));
                let board = Arc::clone(&asked);
                tokio::spawn(async move {
                    let mut far = BufReader::new(far);
                    let mut line = String::new();
                    while far.read_line(&mut line).await.is_ok_and(|count| count > 0) {
                        let said = match line.trim().strip_prefix("M118 ") {
                            Some(mark) if echoes => format!("{mark}\nok\n"),
                            Some(_) => "ok\n".to_owned(),
                            None => {
                                let number = board.fetch_add(1, Ordering::Relaxed) + 1;
                                format!("Analog in = {number:5}\nok\n")
                            }
                        };
                        line.clear();
                        if far.get_mut().write_all(said.as_bytes()).await.is_err() {
                            return;
                        }
                    }
                });
                let (near, hold) = held_link(near, 20, Duration::from_millis(pause_ms));
                let config: MarlinPinConfig =
                    toml_text(std::path::Path::new("rig.toml"), "pin = 57").expect("a valid table");
                let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
                let mut receiver = MarlinPinReceiver::begin(wire, &config).await.expect("opens");
                hold.send_replace(true);
                let given_up = receiver.read_point(Duration::ZERO, 4).await;
                assert!(given_up.is_err(), "nothing came");
                hold.send_replace(false);
                for _ in 0..6 {
                    // Here the robot moves.
                    let before = asked.load(Ordering::Relaxed);
                    if let Ok(counts) = receiver.value().await {
                        assert!(
                            counts > f64::from(before),
                            "{echoes} {pause_ms}: it is {counts}, of before the query {before}"
                        );
                    }
                }
                assert!(receiver.value().await.is_ok(), "it catches up in the end");
            }
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_it_panic(line in "\\PC{0,60}") {
            let _ = value_in(&line, "T:");
            let _ = value_in(&format!("T:{line}"), "T:");
        }
    }
}
