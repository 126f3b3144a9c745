//! An array that is driven by a program of the laboratory's own: each change of state is written to a file as a line.
//!
//! Each line holds the whole state, so a reader needs the last line only.
//!
//! ```text
//! time,emitting,modulation_hz,modulation_duty_percent,element_0_us,element_1_us
//! 2026-01-01T00:00:00.125Z,true,0,100,0.000,-
//! ```
//! or `{"time":"…","emitting":true,"modulation_hz":0.0,"modulation_duty_percent":100.0,"delays_us":[0.0,null]}`. A delay is counted
//! from the common trigger, in microseconds; an element without one is silent.

use std::io::{Read as _, Write as _};
use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

use async_trait::async_trait;
use jiff::Timestamp;
use serde::Deserialize;
use serde_json::json;

use super::{ArrayIdentity, ElementDelay, Modulation};
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::{Emergency, FocusArray};
use fieldgap_input::Frequency;

/// How the first line of a CSV file begins.
const HEADER: &str = "time,emitting,modulation_hz,modulation_duty_percent";

/// How much of a file is read to recognise it, bytes: a first line of 10,000 elements.
const LONGEST_FIRST_LINE: u64 = 1 << 18;

/// `[focus_array.file]`: the file, and what stands behind it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileSinkConfig {
    /// The file, from the rig file's folder; lines are added at its end. A named pipe serves as well.
    path: PathBuf,
    /// How its lines are written.
    #[serde(default)]
    format: Format,
    /// Elements of the array.
    elements: std::num::NonZeroUsize,
    /// The carrier that the array makes, Hz.
    #[serde(default = "forty_kilohertz")]
    carrier_hz: Frequency,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Format {
    #[default]
    Csv,
    JsonLines,
}

fn forty_kilohertz() -> Frequency {
    Frequency::new(40e3).expect("a literal in range")
}

impl FileSinkConfig {
    /// Takes the path of the file from `folder`, which is the rig file's.
    pub fn beside(&mut self, folder: &Path) {
        self.path = folder.join(&self.path);
    }

    pub(crate) async fn open(
        &self,
        modulation: Modulation,
        _: Option<&str>,
    ) -> Result<Box<dyn FocusArray>, RigError> {
        Ok(Box::new(FileSink::begin(self, modulation)?))
    }
}

/// The file, and the state in its last line.
#[derive(Debug)]
struct FileSink {
    file: std::fs::File,
    device: Device,
    format: Format,
    identity: ArrayIdentity,
    emitting: bool,
    modulation: Modulation,
    delays: Vec<ElementDelay>,
}

impl FileSink {
    fn begin(config: &FileSinkConfig, modulation: Modulation) -> Result<Self, RigError> {
        let device = Device::new(Role::FocusArray, config.path.display().to_string());
        let failed = |error| {
            RigError::new(device.clone(), "opening the file", Cause::Unwritable(error), None)
        };
        if !may_be_added_to(&config.path).map_err(failed)? {
            return Err(RigError::new(device, "opening the file", Cause::ForeignFile, None));
        }
        let file = std::fs::OpenOptions::new().append(true).create(true).open(&config.path);
        let file = file.map_err(failed)?;
        let is_new = file.metadata().map_err(failed)?.len() == 0;
        let elements = config.elements.get();
        // Delays are written in thousandths of a microsecond.
        let clock_hz = 1e9;
        let identity = ArrayIdentity {
            name: "a file".to_owned(),
            elements,
            clock_hz,
            period_steps: (clock_hz / config.carrier_hz.get()).round().max(1.0) as u32,
            most_frames: 0,
            most_levels: 0,
            most_sensors: 0,
            acknowledges: false,
        };
        let mut sink = Self {
            file,
            device,
            format: config.format,
            identity,
            emitting: false,
            modulation,
            delays: vec![ElementDelay::Silent; elements],
        };
        if is_new && config.format == Format::Csv {
            let mut header = HEADER.to_owned();
            header.extend((0..elements).map(|element| format!(",element_{element}_us")));
            sink.add(&header, "writing its first line")?;
        }
        sink.write_state("silencing the array on opening")?;
        Ok(sink)
    }

    fn write_state(&mut self, attempt: &str) -> Result<(), RigError> {
        self.add(&self.line(Timestamp::now()), attempt)
    }

    /// Adds a line in one piece, so that a reader never sees half of one.
    fn add(&mut self, line: &str, attempt: &str) -> Result<(), RigError> {
        self.file.write_all(format!("{line}\n").as_bytes()).map_err(|error| {
            RigError::new(self.device.clone(), attempt, Cause::Unwritable(error), None)
        })
    }

    fn line(&self, time: Timestamp) -> String {
        let Self { emitting, modulation: Modulation { frequency_hz, duty_percent }, .. } = self;
        let microseconds = |delay: &ElementDelay| match delay {
            ElementDelay::Seconds(delay_s) => Some((delay_s * 1e9).round() / 1e3),
            ElementDelay::Silent => None,
        };
        let delays = self.delays.iter().map(microseconds);
        match self.format {
            Format::Csv => {
                let mut line = format!("{time:.3},{emitting},{frequency_hz},{duty_percent}");
                line.extend(delays.map(|delay| match delay {
                    Some(delay_us) => format!(",{delay_us:.3}"),
                    None => ",-".to_owned(),
                }));
                line
            }
            Format::JsonLines => json!({
                "time": format!("{time:.3}"),
                "emitting": emitting,
                "modulation_hz": frequency_hz,
                "modulation_duty_percent": duty_percent,
                "delays_us": delays.collect::<Vec<_>>(),
            })
            .to_string(),
        }
    }
}

/// Whether lines may be added to a file: a new or empty one, a named pipe, or one that this driver has begun.
fn may_be_added_to(path: &Path) -> std::io::Result<bool> {
    let kind = match std::fs::metadata(path) {
        Ok(file) if file.file_type().is_fifo() => return Ok(true),
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(true),
        Err(error) => return Err(error),
    };
    if !kind.is_file() {
        return Ok(false);
    }
    let mut start = Vec::new();
    std::fs::File::open(path)?.take(LONGEST_FIRST_LINE).read_to_end(&mut start)?;
    let first = start.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let is_state = |line: &serde_json::Value| {
        line.get("emitting").is_some() && line.get("delays_us").is_some()
    };
    Ok(start.is_empty()
        || first.starts_with(HEADER.as_bytes())
        || serde_json::from_slice(first).is_ok_and(|line| is_state(&line)))
}

#[async_trait]
impl FocusArray for FileSink {
    fn device(&self) -> &Device {
        &self.device
    }

    fn identity(&self) -> &ArrayIdentity {
        &self.identity
    }

    async fn silence(&mut self) -> Result<(), RigError> {
        self.emitting = false;
        self.write_state("silencing the array")
    }

    /// No device to silence.
    fn emergency(&self) -> Option<Emergency> {
        None
    }

    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError> {
        let attempt = "setting the delays";
        ElementDelay::checked_s(delays, self.identity.elements)
            .map_err(|cause| RigError::new(self.device.clone(), attempt, cause, None))?;
        self.delays = delays.to_vec();
        if self.emitting { self.write_state(attempt) } else { Ok(()) }
    }

    async fn continuous_wave(&mut self) -> Result<(), RigError> {
        self.modulation = Modulation::NONE;
        self.write_state("ending the modulation")
    }

    async fn emit(&mut self) -> Result<(), RigError> {
        self.emitting = true;
        self.write_state("starting emission")
    }
}

impl Drop for FileSink {
    fn drop(&mut self) {
        self.emitting = false;
        // A failing file was reported when it first failed.
        let _ = self.write_state("silencing the array");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::toml_text;

    fn config(folder: &Path, keys: &str) -> FileSinkConfig {
        let text = format!("path = \"delays.csv\"\nelements = 2\n{keys}");
        let mut config: FileSinkConfig = toml_text(Path::new("rig.toml"), &text).expect("valid");
        config.beside(folder);
        config
    }

    async fn focus_and_end(config: &FileSinkConfig) {
        let modulation = Modulation { frequency_hz: 200.0, duty_percent: 50.0 };
        let mut sink = FileSink::begin(config, modulation).expect("it can be written");
        sink.continuous_wave().await.expect("room");
        let delays = [ElementDelay::Seconds(12.3456e-6), ElementDelay::Silent];
        sink.set_delays(&delays).await.expect("two");
        sink.emit().await.expect("room");
    }

    /// The file without its times, which are looked at on their own.
    fn told(config: &FileSinkConfig) -> Vec<String> {
        let text = std::fs::read_to_string(&config.path).expect("it is there");
        text.lines().map(str::to_owned).collect()
    }

    #[tokio::test]
    async fn each_line_of_csv_tells_the_whole_state_and_the_last_is_silent() {
        let folder = tempfile::tempdir().expect("a folder");
        let config = config(folder.path(), "");
        focus_and_end(&config).await;
        let lines = told(&config);
        assert_eq!(
            lines[0],
            "time,emitting,modulation_hz,modulation_duty_percent,element_0_us,element_1_us"
        );
        let states: Vec<&str> =
            lines[1..].iter().map(|line| line.split_once(',').expect("columns").1).collect();
        assert_eq!(
            states,
            ["false,200,50,-,-", "false,0,100,-,-", "true,0,100,12.346,-", "false,0,100,12.346,-"]
        );
        let times: Vec<Timestamp> = lines[1..]
            .iter()
            .map(|line| line.split(',').next().expect("a time").parse().expect("a time"))
            .collect();
        assert!(times.is_sorted());
        // A second time there is no second header.
        focus_and_end(&config).await;
        assert_eq!(told(&config).iter().filter(|line| line.starts_with("time")).count(), 1);
    }

    #[tokio::test]
    async fn lines_of_json_say_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let config = config(folder.path(), "format = \"json-lines\"");
        focus_and_end(&config).await;
        let line: serde_json::Value = serde_json::from_str(&told(&config)[2]).expect("JSON");
        assert_eq!(line["delays_us"], json!([12.346, null]));
        assert_eq!((&line["emitting"], &line["modulation_hz"]), (&json!(true), &json!(0.0)));
    }

    #[tokio::test]
    async fn what_is_no_delay_and_a_file_that_cannot_be_written_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let config = config(folder.path(), "");
        let mut sink = FileSink::begin(&config, Modulation::NONE).expect("it can be written");
        let count = sink.set_delays(&[ElementDelay::Silent]).await.expect_err("one of two");
        assert!(matches!(count.cause(), Cause::ElementCount { has: 2, given: 1 }));
        let bad = [ElementDelay::Silent, ElementDelay::Seconds(f64::NAN)];
        let bad = sink.set_delays(&bad).await.expect_err("no time");
        assert!(matches!(bad.cause(), Cause::BadDelay { element: 1, .. }));
        let nowhere = FileSinkConfig { path: folder.path().join("no/folder"), ..config };
        let error = FileSink::begin(&nowhere, Modulation::NONE).expect_err("no such folder");
        assert!(error.to_string().contains("cannot be written"), "{error}");
    }

    #[tokio::test]
    async fn nothing_is_added_to_a_file_that_holds_something_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let modulation = || Modulation { frequency_hz: 0.0, duty_percent: 100.0 };
        for format in ["", "format = \"json-lines\"\n"] {
            let config = config(folder.path(), format);
            std::fs::write(&config.path, "precious\n").expect("written");
            let error = FileSink::begin(&config, modulation()).expect_err("it is not ours");
            assert!(matches!(error.cause(), Cause::ForeignFile), "{error}");
            assert_eq!(told(&config), ["precious"]);
            std::fs::remove_file(&config.path).expect("it is there");
            focus_and_end(&config).await;
            let begun = told(&config).len();
            focus_and_end(&config).await;
            assert!(told(&config).len() > begun, "its own file is gone on with");
            std::fs::remove_file(&config.path).expect("it is there");
        }
        let mut config = config(folder.path(), "");
        config.path = folder.path().to_owned();
        let error = FileSink::begin(&config, modulation()).expect_err("a folder");
        assert!(matches!(error.cause(), Cause::ForeignFile), "{error}");
    }
}
