//! `[receiver.stream]` and `[receiver.free-running]`

use serde::Deserialize;

use fieldgap_input::{Delay, NonNegative, Positive, Rate, as_narrow};

/// `[receiver.stream]`: a receiver that samples when it is asked (see [`super::protocol`]).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// How samples are sent.
    #[serde(default)]
    pub encoding: Encoding,
}

/// How samples are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// Frames with a checksum: a damaged sample is noticed.
    #[default]
    Binary,
    /// Lines that a person can read: a damaged digit is not noticed.
    Text,
    /// Frames with a checksum that hold both parts of a sample: readings have a phase.
    Iq,
}

/// What a receiver sends that takes no commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lines {
    /// Lines `<t_us> <value>`.
    #[default]
    TimeAndValue,
    /// Lines of numbers without a time, as plain loggers print them. Their instants are counted by `rate_hz`, and a line that
    /// is lost is not noticed.
    Value,
    /// The binary frames of [`super::protocol`].
    Frames,
}

/// `[receiver.free-running]`: a receiver that sends samples without being asked.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FreeRunningConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
    /// What it sends.
    #[serde(default)]
    pub lines: Lines,
    /// Which of the numbers in a line is the value, from 1; of `lines = "value"` alone.
    #[serde(default = "first_column")]
    pub column: std::num::NonZeroUsize,
    /// Samples a second, Hz.
    #[serde(deserialize_with = "as_narrow::<Rate, _, _>")]
    pub rate_hz: Positive,
    /// Unit of its values, for instance `V`.
    pub unit: String,
    /// The magnitude at which its converter clips, in `unit`.
    pub full_scale: Positive,
    /// The longest time between a sample's instant and its arrival here (buffers in the receiver,
    /// in the USB bridge and in this machine), ms. Readings that young are not trusted.
    #[serde(deserialize_with = "as_narrow::<Delay, _, _>")]
    pub latency_ms: NonNegative,
}

fn first_column() -> std::num::NonZeroUsize {
    std::num::NonZeroUsize::MIN
}

fn default_baud() -> u32 {
    115_200
}
