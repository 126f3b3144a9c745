//! Sensors of the air: temperature, and humidity and pressure where they have them.

mod pattern;

use std::time::Duration;

use async_trait::async_trait;
use serde::Deserialize;
use tokio::time::Instant;

use super::AirSensor;
use super::device::{Device, Role};
use super::error::{Cause, RigError};
use super::link::{ByteLink, Wire, open_serial};
use fieldgap_input::Time;
pub use pattern::LinePattern;

/// The state of the air, as a sensor reports it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct AirReading {
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Relative humidity, percent, 0 to 100.
    pub humidity_percent: Option<f64>,
    /// Pressure, kPa.
    pub pressure_kpa: Option<f64>,
}

/// `[environment.lines]`: a sensor that sends lines, by itself or when it is asked.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirLinesConfig {
    /// The serial port; absent where a virtual rig gives it.
    port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    baud: u32,
    /// How a line is read.
    pattern: LinePattern,
    /// What is sent, with a line end, to have one line; absent: lines come by themselves.
    ask: Option<String>,
    /// How long a line may take, s.
    #[serde(default = "five_seconds")]
    line_within_s: Time,
}

fn default_baud() -> u32 {
    9600
}

fn five_seconds() -> Time {
    Time::new(5.0).expect("a literal above zero")
}

impl AirLinesConfig {
    pub(super) async fn open(&self, port: Option<&str>) -> Result<Box<dyn AirSensor>, RigError> {
        let wire = open_serial(Role::Environment, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(AirLines::begin(wire, self).await?))
    }
}

/// A sensor on a line.
#[derive(Debug)]
pub struct AirLines<L> {
    wire: Wire<L>,
    pattern: LinePattern,
    ask: Option<String>,
    within: Duration,
}

impl<L: ByteLink> AirLines<L> {
    /// Waits for the first line that fits the pattern.
    ///
    /// # Errors
    /// That none comes, or none that fits the pattern.
    pub async fn begin(wire: Wire<L>, config: &AirLinesConfig) -> Result<Self, RigError> {
        let within = Duration::try_from_secs_f64(config.line_within_s.get());
        let mut sensor = Self {
            wire,
            pattern: config.pattern.clone(),
            ask: config.ask.clone(),
            within: within.unwrap_or(Duration::MAX),
        };
        sensor.wire.attempting("waiting for the first line");
        if sensor.ask.is_none() {
            // It may have lost its beginning, and read as a smaller number.
            sensor.wire.line(Instant::now() + sensor.within).await?;
        }
        sensor.newest().await?;
        Ok(sensor)
    }

    /// The newest of the lines that have come, or the next one.
    async fn newest(&mut self) -> Result<AirReading, RigError> {
        let until = Instant::now() + self.within;
        if let Some(ask) = &self.ask {
            let ask = format!("{ask}\n");
            while Instant::now() < until && !self.wire.bytes(Instant::now()).await?.is_empty() {}
            self.wire.send(ask.as_bytes()).await?;
        }
        let (mut newest, mut unread) = (None, None);
        while Instant::now() < until {
            let wait = if newest.is_some() { Instant::now() } else { until };
            let Some(line) = self.wire.line(wait).await? else { break };
            match self.pattern.read(&line) {
                Some(reading) => newest = Some(reading),
                None => unread = Some(line),
            }
        }
        newest.ok_or_else(|| match unread {
            Some(seen) => self.wire.error(Cause::Unreadable { seen }),
            None => self.wire.error(Cause::Silent { waited: self.within }),
        })
    }
}

#[async_trait]
impl<L: ByteLink> AirSensor for AirLines<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    async fn air(&mut self) -> Result<AirReading, RigError> {
        self.wire.attempting("reading the air");
        self.newest().await
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

    use super::*;
    use fieldgap_input::toml_text;

    fn config(more: &str) -> AirLinesConfig {
        let text = format!("pattern = \"{{temperature_c}},{{humidity_percent}}\"\n{more}");
        toml_text(std::path::Path::new("rig.toml"), &text).expect("valid")
    }

    fn pair() -> (Wire<DuplexStream>, DuplexStream) {
        let (near, far) = duplex(4096);
        (Wire::new(near, Device::new(Role::Environment, "memory")), far)
    }

    #[tokio::test(start_paused = true)]
    async fn the_newest_line_counts_and_the_first_may_be_torn() {
        let (wire, mut far) = pair();
        far.write_all(b"1.5,40\n21.5,40\n21.6,41\n").await.expect("room");
        let mut sensor = AirLines::begin(wire, &config("")).await.expect("lines come");
        far.write_all(b"21.7,42\r\nwarming up\n21.8,43\n21.").await.expect("room");
        let air = sensor.air().await.expect("a line");
        assert_eq!((air.temperature_c, air.humidity_percent), (21.8, Some(43.0)));
        // Half a line is no line.
        let waiting = tokio::time::timeout(Duration::from_secs(1), sensor.air()).await;
        assert!(waiting.is_err());
        far.write_all(b"9,44\n").await.expect("room");
        assert_eq!(sensor.air().await.expect("a line").temperature_c, 21.9);
    }

    #[tokio::test(start_paused = true)]
    async fn a_sensor_may_be_asked() {
        let (wire, mut far) = pair();
        tokio::spawn(async move {
            let mut received = [0; 16];
            for degrees in 20.. {
                let count = far.read(&mut received).await.unwrap_or(0);
                if &received[..count] != b"R\n" {
                    return;
                }
                far.write_all(format!("{degrees},50\n").as_bytes()).await.expect("room");
            }
        });
        let mut sensor = AirLines::begin(wire, &config("ask = \"R\"")).await.expect("it answers");
        assert_eq!(sensor.air().await.expect("it answers").temperature_c, 21.0);
        assert_eq!(sensor.air().await.expect("it answers").temperature_c, 22.0);
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_one_and_one_of_other_words_are_named() {
        let (wire, far) = pair();
        let error = AirLines::begin(wire, &config("")).await.expect_err("silent");
        assert!(error.to_string().starts_with("environment sensor on memory, waiting"), "{error}");
        assert!(matches!(error.cause(), Cause::Silent { .. }));
        drop(far);
        let (wire, mut far) = pair();
        far.write_all(b"hello\nhello\nhello\n").await.expect("room");
        let error = AirLines::begin(wire, &config("")).await.expect_err("no numbers");
        assert!(matches!(error.cause(), Cause::Unreadable { .. }), "{error}");
        drop(far);
    }
}
