//! A calibration file: what each element of an array was measured to emit, with errors, date and conditions.
//!
//! A channel is an output of the array's controller. In a sound array channel n drives element n; where two were swapped, the file says
//! which element a channel drives.

use std::fmt::Write as _;
use std::path::Path;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::value::Datetime;

use fieldgap_acoustics::{Array, Element};
use fieldgap_input::{Fault, Label, NonNegative, SoundSpeed, TomlSource};

/// The format of calibration files that this program reads and writes.
const FORMAT: i64 = 1;

/// The name of a calibration file beside a record.
pub const CALIBRATION_BESIDE: &str = "calibration.toml";

/// What a channel was found to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelState {
    /// Within what elements of one batch differ by.
    Sound,
    /// It emits much less than the others.
    Weak,
    /// It emits nothing that could be measured.
    Dead,
    /// It is wired in reverse: its phase is half a turn off.
    Reversed,
    /// It drives another element's place.
    Swapped,
}

impl std::fmt::Display for ChannelState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Sound => "sound",
            Self::Weak => "weak",
            Self::Dead => "dead",
            Self::Reversed => "reversed",
            Self::Swapped => "swapped",
        })
    }
}

/// One channel as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedChannel {
    /// Amplitude relative to the median of the array, zero or above.
    pub gain: f64,
    /// Its standard error.
    pub gain_error: f64,
    /// Phase in addition to the drive's, rad, relative to the array's mean. That of a reversed channel includes the half turn; that of a
    /// dead one is zero.
    pub phase_rad: f64,
    /// Its standard error, rad.
    pub phase_error_rad: f64,
    /// What it was found to be.
    pub state: ChannelState,
    /// Number of the element that it drives.
    pub drives: usize,
}

/// Under what conditions a calibration was measured, and how well its model fits.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationConditions {
    /// Name of the rig or record.
    pub array: String,
    /// When it was measured.
    pub measured: Timestamp,
    /// SHA-256 of the text of the rig file or of the record's set-up, hexadecimal.
    pub setup_sha256: String,
    /// Speed of sound that was fitted, m/s.
    pub speed_of_sound_m_s: f64,
    /// Readings that the fit used.
    pub readings: usize,
    /// Noise of one reading, relative to the rms of all.
    pub noise: f64,
    /// Rms of what the fit leaves, relative to the rms of all.
    pub residual: f64,
}

/// A calibration file, and its text, which is kept with every record of a calibrated array.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationFile {
    conditions: CalibrationConditions,
    channels: Vec<CalibratedChannel>,
    text: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: Spanned<i64>,
    array: Label,
    measured: Spanned<Datetime>,
    setup_sha256: Label,
    speed_of_sound_m_s: SoundSpeed,
    readings: u32,
    noise_percent: NonNegative,
    residual_percent: NonNegative,
    channels: Spanned<Vec<Spanned<Row>>>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    gain: NonNegative,
    gain_error: NonNegative,
    phase_deg: f64,
    phase_error_deg: NonNegative,
    #[serde(default = "sound")]
    state: ChannelState,
    drives: Option<usize>,
}

fn sound() -> ChannelState {
    ChannelState::Sound
}

impl CalibrationFile {
    /// A calibration as it was measured.
    ///
    /// Numbers are rounded as the file writes them, so that a calibration does not change when it is written and read.
    pub fn new(conditions: CalibrationConditions, channels: Vec<CalibratedChannel>) -> Self {
        let text = text_of(&conditions, &channels);
        let source = TomlSource::new(Path::new(CALIBRATION_BESIDE), text);
        Self::parse(&source).expect("numbers and texts of a calibration are TOML")
    }

    /// Reads a calibration file.
    ///
    /// # Errors
    /// A [`Fault`] at the key that does not fit.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::parse(&TomlSource::read(path)?)
    }

    /// Reads the file that a key of `source` names, relative to the folder of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at the key if there is no such file; and as [`CalibrationFile::read`].
    pub fn named(name: &Spanned<String>, source: &TomlSource) -> Result<Self, Fault> {
        let file = source.path().parent().unwrap_or(Path::new("")).join(name.get_ref());
        if !file.exists() {
            return Err(source.fault(
                name.span(),
                format!("there is no calibration file {}", file.display()),
                "measure one with `fieldgap calibrate`, or remove the key",
            ));
        }
        Self::read(&file)
    }

    /// Reads a text as a calibration file.
    ///
    /// # Errors
    /// As [`CalibrationFile::read`].
    pub fn parse(source: &TomlSource) -> Result<Self, Fault> {
        let file: File = source.parse()?;
        if *file.format.get_ref() != FORMAT {
            return Err(source.fault(
                file.format.span(),
                format!("format {} is unknown", file.format.get_ref()),
                format!("this program reads format {FORMAT}"),
            ));
        }
        let measured = file.measured.get_ref().to_string().parse().map_err(|_| {
            source.fault(
                file.measured.span(),
                "this is not a point in time",
                "write date, time and zone, such as 2026-11-20T17:00:00Z",
            )
        })?;
        let rows = file.channels.get_ref();
        let mut taken = vec![false; rows.len()];
        let mut channels = Vec::with_capacity(rows.len());
        for (n, row) in rows.iter().enumerate() {
            let Row { gain, gain_error, phase_deg, phase_error_deg, state, drives } =
                *row.get_ref();
            let drives = drives.unwrap_or(n);
            let is_free =
                taken.get_mut(drives).is_some_and(|taken| !std::mem::replace(taken, true));
            if !is_free || !phase_deg.is_finite() {
                return Err(source.fault(
                    row.span(),
                    "each channel drives one element of the array, and its phase is a number",
                    "correct `drives` or `phase_deg`",
                ));
            }
            channels.push(CalibratedChannel {
                gain: gain.get(),
                gain_error: gain_error.get(),
                phase_rad: phase_deg.to_radians(),
                phase_error_rad: phase_error_deg.get().to_radians(),
                state,
                drives,
            });
        }
        if channels.is_empty() {
            return Err(source.fault(
                file.channels.span(),
                "the calibration has no channel",
                "it has one for each element",
            ));
        }
        let conditions = CalibrationConditions {
            array: file.array.into(),
            measured,
            setup_sha256: file.setup_sha256.into(),
            speed_of_sound_m_s: file.speed_of_sound_m_s.get(),
            readings: file.readings as usize,
            noise: file.noise_percent.get() / 100.0,
            residual: file.residual_percent.get() / 100.0,
        };
        Ok(Self { conditions, channels, text: source.text().to_owned() })
    }

    /// Conditions and quality.
    pub fn conditions(&self) -> &CalibrationConditions {
        &self.conditions
    }

    /// The channels, in the order of the controller's outputs; at least one.
    pub fn channels(&self) -> &[CalibratedChannel] {
        &self.channels
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The array as it was measured: element n is the one that channel n drives, with the amplitude of the channel, and with its phase
    /// unless the drive is compensated for it. Dead channels have no amplitude. `None` for another number of elements.
    pub fn applied_to(&self, array: &Array, compensated: bool) -> Option<Array> {
        if array.len() != self.channels.len() {
            return None;
        }
        let element = |channel: &CalibratedChannel| {
            let nominal = array.elements()[channel.drives];
            let silent = channel.state == ChannelState::Dead;
            Element {
                amplitude: if silent { 0.0 } else { nominal.amplitude * channel.gain },
                phase_rad: nominal.phase_rad + if compensated { 0.0 } else { channel.phase_rad },
                ..nominal
            }
        };
        let calibrated = Array::from_elements(self.channels.iter().map(element).collect());
        let calibrated = calibrated.expect("as many elements as before");
        Some(match array.shared_transducer() {
            Some(transducer) => calibrated.with_transducer(transducer),
            None => calibrated,
        })
    }
}

fn text_of(conditions: &CalibrationConditions, channels: &[CalibratedChannel]) -> String {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let mut text = format!(
        "# What each channel of an array was measured to emit. A rig file names it: [array] calibration = \"…\".\n\
         format = {FORMAT}\narray = {}\nmeasured = {}\nsetup_sha256 = {}\n\
         speed_of_sound_m_s = {:.3}\nreadings = {}\nnoise_percent = {:.4}\nresidual_percent = {:.4}\n\
         # Gain relative to the median, phase in addition to the drive's, each with its standard error.\nchannels = [\n",
        quoted(&conditions.array),
        conditions.measured,
        quoted(&conditions.setup_sha256),
        conditions.speed_of_sound_m_s,
        conditions.readings,
        conditions.noise * 100.0,
        conditions.residual * 100.0,
    );
    for (n, channel) in channels.iter().enumerate() {
        let _ = write!(
            text,
            "  {{ gain = {:.5}, gain_error = {:.5}, phase_deg = {:.3}, phase_error_deg = {:.3}",
            channel.gain,
            channel.gain_error,
            channel.phase_rad.to_degrees(),
            channel.phase_error_rad.to_degrees(),
        );
        if channel.state != ChannelState::Sound {
            let _ = write!(text, ", state = \"{}\"", channel.state);
        }
        if channel.drives != n {
            let _ = write!(text, ", drives = {}", channel.drives);
        }
        text += " },\n";
    }
    text + "]\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn conditions() -> CalibrationConditions {
        CalibrationConditions {
            array: "bench \"two\"".to_owned(),
            measured: "2026-11-20T17:00:00Z".parse().expect("a date"),
            setup_sha256: "00ff".to_owned(),
            speed_of_sound_m_s: 343.21,
            readings: 900,
            noise: 0.02,
            residual: 0.021,
        }
    }

    fn channel(gain: f64, phase_deg: f64, state: ChannelState, drives: usize) -> CalibratedChannel {
        CalibratedChannel {
            gain,
            gain_error: 0.004,
            phase_rad: f64::to_radians(phase_deg),
            phase_error_rad: f64::to_radians(0.25),
            state,
            drives,
        }
    }

    fn swapped() -> CalibrationFile {
        CalibrationFile::new(
            conditions(),
            vec![
                channel(1.03, 4.5, ChannelState::Sound, 0),
                channel(0.97, -3.0, ChannelState::Swapped, 2),
                channel(1.0, 1.0, ChannelState::Swapped, 1),
                channel(0.01, 0.0, ChannelState::Dead, 3),
            ],
        )
    }

    #[test]
    fn a_calibration_reads_back_as_it_was_written() {
        let file = swapped();
        let source = TomlSource::new(Path::new("c.toml"), file.text().to_owned());
        assert_eq!(CalibrationFile::parse(&source).expect("valid"), file);
        assert_eq!(file.conditions(), &conditions());
        assert!((file.channels()[0].phase_rad - f64::to_radians(4.5)).abs() < 1e-12);
    }

    #[test]
    fn the_calibrated_array_has_the_elements_that_the_channels_drive() {
        let array = Array::linear(4, 0.01).expect("not empty");
        let [free, compensated] =
            [false, true].map(|by| swapped().applied_to(&array, by).expect("four elements"));
        assert_eq!(free.elements()[1].centre_m, array.elements()[2].centre_m);
        assert_eq!(free.elements()[2].centre_m, array.elements()[1].centre_m);
        assert!((free.elements()[1].phase_rad - f64::to_radians(-3.0)).abs() < 1e-12);
        assert_eq!(compensated.elements()[1].phase_rad, 0.0);
        assert_eq!(free.elements()[3].amplitude, 0.0);
        assert!(swapped().applied_to(&Array::hexagonal(1, 0.01), true).is_none());
    }

    #[test]
    fn a_fault_names_its_line() {
        let cases = [
            ("format = 1", "format = 2", 2),
            ("drives = 2", "drives = 9", 13),
            ("drives = 2", "drives = 0", 13),
            ("phase_deg = 4.500", "phase_deg = nan", 12),
            ("gain = 1.03000", "gain = -1.0", 12),
            ("state = \"dead\"", "state = \"ded\"", 15),
        ];
        for (from, to, line) in cases {
            let text = swapped().text().replacen(from, to, 1);
            assert_ne!(text, swapped().text(), "{from}");
            let source = TomlSource::new(Path::new("c.toml"), text);
            let fault = CalibrationFile::parse(&source).expect_err(to);
            assert_eq!(fault.line_column().map(|(line, _)| line), Some(line), "{fault}");
        }
    }
}
