//! The serial protocol of the thesis's array controller, version 1.
//!
//! 8 data bits, no parity, 1 stop bit; ASCII lines. The host sends
//!
//! ```text
//! <seq> <command> [args]*<crc>
//! ```
//!
//! and the controller answers `<seq> ok [args]*<crc>` or `<seq> error <code> <text>*<crc>`. `seq` is a decimal of 16 bits
//! chosen by the host; `crc` is CRC-32 (IEEE 802.3) over all before the `*`, eight lowercase hexadecimal digits. A
//! line whose checksum is wrong is answered `- error 1 checksum*<crc>`. Every command may be sent twice.
//!
//! | command | answer | effect |
//! |---|---|---|
//! | `hello` | `ok thesis-array 1 elements=36 clock_hz=10240000 period_steps=256 frames=4096 levels=4096 sensors=4` | |
//! | `off`, `on` | `ok` | emission; off at power-up. `off` also ends a display |
//! | `delays <d0> <d1> …` | `ok` | for each element its delay in clock steps, 0 to `period_steps` - 1, or `-` = silent; at once. Ends a display |
//! | `modulate <hz> <duty_percent>` | `ok` | `0 100` = a continuous wave; not for displays, which have their envelope |
//! | `state` | `ok off`, `ok on`, `ok playing` | |
//!
//! # Displays
//! A controller with `frames` above 0 holds a display: frames that follow each other in a loop, and an envelope, a loop
//! of levels that scale all channels. Both loops begin together and do not wait for each other.
//!
//! | command | answer | effect |
//! |---|---|---|
//! | `frame <n> <hold> <c0> <c1> …` | `ok` | the frame of this number, held for so many periods of the carrier. A channel is `-` = silent, `<delay>`, or `<delay>:<level>` with a level of 0 to 255 |
//! | `envelope <first> <l0> <l1> …` | `ok` | levels of 0 to 255, from this place of the envelope on |
//! | `play <frames> <levels> <hold> <loops> <lease_ms>` | `ok` | plays the first frames under the first levels, each level held for `hold` periods of the carrier; `loops` = 0: without end. Falls silent after the last loop, and where no line comes from the host for `lease_ms`. Sent twice, it begins again |
//!
//! While a display plays, `frame` and `envelope` are refused with error 4. A channel of level l under a level e of the envelope sends
//! pulses of w = P/π asin(l e / 255²) clock steps (P = `period_steps`), to the nearest step, in the middle of the half
//! period that a full pulse would fill: [`super::Channel::pulse`].
//!
//! # Receiving
//! A controller with `sensors` above 0 can receive with some of its elements, which are then silent.
//!
//! | command | answer | effect |
//! |---|---|---|
//! | `sense <rate_hz> <e0> <e1> …` | `ok` | from now on, at this rate, a line `sensed <n> <t_us> <v0> <v1> …*<crc>`: number of the sample from 0, µs since power-up, the rectified and smoothed signal of each element in volts |
//! | `sense 0` | `ok` | ends it |
//!
//! A sample of four elements is a line of up to 80 bytes: 250 a second need 230400 baud.

use super::{ArrayIdentity, THESIS_NAME};
use crate::key_value::value_of;

/// The error code of a line that arrived damaged.
pub const CODE_CHECKSUM: u16 = 1;

/// What a controller answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// Done.
    Ok {
        /// The line it answers.
        seq: u16,
        /// What was asked for, where something was.
        args: String,
    },
    /// Not done.
    Error {
        /// The line it answers; `None` where that could not be read.
        seq: Option<u16>,
        /// Why, as a number.
        code: u16,
        /// Why, as text.
        text: String,
    },
}

/// A command as a line with its checksum and line end.
pub fn encode(seq: u16, command: &str) -> String {
    let body = format!("{seq} {command}");
    format!("{body}*{:08x}\n", crc32fast::hash(body.as_bytes()))
}

/// Reads an answer; `None` if it is damaged or is no answer.
pub fn decode(line: &str) -> Option<Reply> {
    let (body, crc) = line.rsplit_once('*')?;
    if crc != format!("{:08x}", crc32fast::hash(body.as_bytes())) {
        return None;
    }
    let (seq, answer) = body.split_once(' ')?;
    let (verdict, args) = answer.split_once(' ').unwrap_or((answer, ""));
    match verdict {
        "ok" => Some(Reply::Ok { seq: seq.parse().ok()?, args: args.to_owned() }),
        "error" => {
            let (code, text) = args.split_once(' ').unwrap_or((args, ""));
            let seq = if seq == "-" { None } else { Some(seq.parse().ok()?) };
            Some(Reply::Error { seq, code: code.parse().ok()?, text: text.to_owned() })
        }
        _ => None,
    }
}

/// Reads the answer to `hello`; `None` if it is another controller or another version.
pub fn parse_identity(args: &str) -> Option<ArrayIdentity> {
    let settings = args.strip_prefix(THESIS_NAME)?.strip_prefix(' ')?;
    let setting = |key: &str| value_of(settings, key);
    // Controllers without displays leave them out.
    let capacity = |key: &str| setting(key).map_or(Some(0), |value| value.parse().ok());
    Some(ArrayIdentity {
        name: THESIS_NAME.to_owned(),
        elements: setting("elements")?.parse().ok().filter(|count| *count > 0)?,
        clock_hz: setting("clock_hz")?
            .parse()
            .ok()
            .filter(|hz: &f64| hz.is_finite() && *hz > 0.0)?,
        period_steps: setting("period_steps")?.parse().ok().filter(|steps| *steps > 0)?,
        most_frames: capacity("frames")?,
        most_levels: capacity("levels")?,
        most_sensors: capacity("sensors")?,
        acknowledges: true,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_command_carries_number_and_checksum() {
        let line = encode(7, "off");
        let (body, crc) = line.trim_end().split_once('*').expect("a checksum");
        assert_eq!(body, "7 off");
        assert_eq!(crc, format!("{:08x}", crc32fast::hash(b"7 off")));
    }

    #[test]
    fn answers_are_read() {
        let with_crc = |body: &str| format!("{body}*{:08x}", crc32fast::hash(body.as_bytes()));
        let known = [
            ("7 ok", Reply::Ok { seq: 7, args: String::new() }),
            ("7 ok on", Reply::Ok { seq: 7, args: "on".into() }),
            ("- error 1 checksum", Reply::Error { seq: None, code: 1, text: "checksum".into() }),
            ("9 error 3 too many", Reply::Error { seq: Some(9), code: 3, text: "too many".into() }),
        ];
        for (body, reply) in known {
            assert_eq!(decode(&with_crc(body)), Some(reply), "{body}");
        }
        for body in ["7", "x ok", "- ok", "7 maybe", "70000 ok"] {
            assert_eq!(decode(&with_crc(body)), None, "{body}");
        }
        assert_eq!(decode("7 ok*00000000"), None);
    }

    #[test]
    fn the_identity_is_read_and_a_useless_one_refused() {
        let hello = "thesis-array 1 elements=36 clock_hz=10240000 period_steps=256";
        let identity = parse_identity(hello).expect("valid");
        assert_eq!(
            (identity.elements, identity.clock_hz, identity.period_steps),
            (36, 10_240_000.0, 256)
        );
        assert_eq!((identity.most_frames, identity.most_levels, identity.most_sensors), (0, 0, 0));
        let display = format!("{hello} frames=4096 levels=1024 sensors=4");
        let identity = parse_identity(&display).expect("valid");
        assert_eq!(
            (identity.most_frames, identity.most_levels, identity.most_sensors),
            (4096, 1024, 4)
        );
        assert_eq!(parse_identity(&format!("{hello} frames=many")), None);
        assert_eq!(parse_identity(&hello.replace("array 1", "array 2")), None);
        assert_eq!(parse_identity(&hello.replace("period_steps=256", "period_steps=0")), None);
        assert_eq!(parse_identity("thesis-array 1 "), None);
    }

    proptest! {
        #[test]
        fn no_line_makes_the_decoder_panic(line in "\\PC{0,60}") {
            decode(&line);
            parse_identity(&line);
        }

        #[test]
        fn damage_to_one_character_is_noticed(seq in any::<u16>(), at in 0usize..15, with in 0x20u8..0x7f) {
            let body = format!("{seq} ok on");
            let line = format!("{body}*{:08x}", crc32fast::hash(body.as_bytes()));
            let mut damaged = line.clone().into_bytes();
            let at = at % damaged.len();
            damaged[at] = with;
            let damaged = String::from_utf8(damaged).expect("ASCII");
            prop_assert!(damaged == line || decode(&damaged).is_none(), "{}", damaged);
        }
    }
}
