//! The receiver's serial protocol, version 1.
//!
//! 8 data bits, no parity, 1 stop bit. The host sends ASCII lines ended by `\n`:
//!
//! | line | answer |
//! |---|---|
//! | `?` | `receiver 1 rate_hz=1000 full_scale=5.000000 unit=V` |
//! | `E text`, `E binary`, `E iq` | `ok`; how samples are sent from now on |
//! | `S <n>` | no line; `n` samples, the first taken at the instant the command is received, then an end mark; `n` = 0: until `X` |
//! | `X` | stops sampling; the end mark follows |
//! | `T` | `time <t_us>` |
//! | anything else | `error <text>` |
//!
//! `t_us` is the receiver's own clock, microseconds since its power-up, 64 bits. `seq` counts every sample since power-up
//! in 32 bits and wraps.
//!
//! # Text
//! A sample is `<seq> <t_us> <value>`, with ` !` behind it where the converter clipped; the value is a decimal in `unit`.
//! The end mark is `end <next seq> <t_us>`. A damaged digit cannot be noticed in text: use it for reading along, and
//! binary for scanning.
//!
//! # Binary
//! A frame of 24 bytes, little endian:
//!
//! | bytes | |
//! |---|---|
//! | 0, 1 | A5 5A |
//! | 2 | kind: 1 sample, 2 end mark |
//! | 3 | flags: bit 0 = the converter clipped |
//! | 4..8 | `seq`; in the end mark the next one |
//! | 8..16 | `t_us` |
//! | 16..20 | value, IEEE 754 single |
//! | 20..24 | CRC-32 (IEEE 802.3) over bytes 2..20 |
//!
//! # I/Q
//! Samples with a phase against the clock that the drives are made from. The end mark is that of the binary encoding; a sample is a frame of
//! 28 bytes of the same form:
//!
//! | bytes | |
//! |---|---|
//! | 0..16 | as above, kind 3 |
//! | 16..20, 20..24 | I and Q, IEEE 754 single: the signal is I cos ωt + Q sin ωt, the real part of (I + iQ) exp(-iωt), at the time t of the clock |
//! | 24..28 | CRC-32 over bytes 2..24 |

use super::reading::ReceiverIdentity;
use crate::key_value::value_of;

/// One sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Which sample since power-up, modulo 2^32.
    pub seq: u32,
    /// When it was taken, µs since power-up.
    pub t_us: u64,
    /// What was measured, in the receiver's unit; of an I/Q sample, the part in phase. May be anything that a float can be.
    pub value: f64,
    /// Of an I/Q sample, the part in quadrature.
    pub quadrature: Option<f64>,
    /// Whether the converter clipped.
    pub clipped: bool,
}

/// What a receiver sends while it samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A sample.
    Sample(Sample),
    /// The end of a run of samples.
    End {
        /// The number that the next sample will have.
        next_seq: u32,
        /// When the run ended, µs since power-up.
        t_us: u64,
    },
}

/// Reads the answer to `?`. `None` if it is another line or another version.
pub fn parse_identity(line: &str) -> Option<ReceiverIdentity> {
    let settings = line.strip_prefix("receiver 1 ")?;
    let setting = |key: &str| value_of(settings, key);
    let positive =
        |key: &str| setting(key)?.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0);
    Some(ReceiverIdentity {
        rate_hz: positive("rate_hz")?,
        full_scale: positive("full_scale")?,
        unit: setting("unit").filter(|unit| !unit.is_empty())?.to_owned(),
        own_clock: true,
        phase: false,
    })
}

/// Reads the answer to `T`, µs.
pub fn parse_time(line: &str) -> Option<u64> {
    line.strip_prefix("time ")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_identity_is_read() {
        let identity = parse_identity("receiver 1 rate_hz=1000 full_scale=5.000000 unit=V");
        let expected = ReceiverIdentity {
            rate_hz: 1000.0,
            full_scale: 5.0,
            unit: "V".into(),
            own_clock: true,
            phase: false,
        };
        assert_eq!(identity, Some(expected));
    }

    #[test]
    fn another_version_or_a_useless_value_is_no_identity() {
        for line in [
            "receiver 2 rate_hz=1000 full_scale=5.0 unit=V",
            "receiver 1 rate_hz=0 full_scale=5.0 unit=V",
            "receiver 1 rate_hz=1000 full_scale=inf unit=V",
            "receiver 1 rate_hz=1000 full_scale=5.0 unit=",
            "receiver 1 rate_hz=1000",
            "Grbl 1.1h ['$' for help]",
        ] {
            assert_eq!(parse_identity(line), None, "{line}");
        }
    }
}
