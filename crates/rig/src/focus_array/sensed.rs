//! Samples of receiving elements.

use std::fmt::Write as _;

/// One sample of every element that listens.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Which sample since listening began, modulo 2^32.
    pub number: u32,
    /// When it was taken, µs since the controller's power-up.
    pub t_us: u64,
    /// The rectified and smoothed signal of each, V, in the order in which they were asked for.
    pub volts: Vec<f64>,
}

impl Sensed {
    /// As a line of the wire, with its checksum and line end.
    pub fn encode(&self) -> String {
        let mut body = format!("sensed {} {}", self.number, self.t_us);
        for volts in &self.volts {
            write!(body, " {volts:.6}").expect("a string takes all");
        }
        let crc = crc32fast::hash(body.as_bytes());
        format!("{body}*{crc:08x}\n")
    }

    /// Whether a line is a sample, whole or damaged: nothing else begins like one.
    pub fn is_sample(line: &str) -> bool {
        line.starts_with("sensed ")
    }

    /// Reads a line; `None` if it is damaged or is no sample.
    pub fn decode(line: &str) -> Option<Self> {
        let (body, crc) = line.rsplit_once('*')?;
        if crc != format!("{:08x}", crc32fast::hash(body.as_bytes())) {
            return None;
        }
        let mut words = body.strip_prefix("sensed ")?.split(' ');
        let number = words.next()?.parse().ok()?;
        let t_us = words.next()?.parse().ok()?;
        let finite = |word: &str| word.parse().ok().filter(|volts: &f64| volts.is_finite());
        let volts = words.map(finite).collect::<Option<Vec<f64>>>()?;
        (!volts.is_empty()).then_some(Self { number, t_us, volts })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_is_sent_is_what_is_read(
            number: u32, t_us: u64, microvolts in prop::collection::vec(0u32..5_000_000, 1..9),
        ) {
            let volts = microvolts.into_iter().map(|microvolts| f64::from(microvolts) / 1e6).collect();
            let sensed = Sensed { number, t_us, volts };
            prop_assert!(Sensed::is_sample(&sensed.encode()));
            prop_assert_eq!(Sensed::decode(sensed.encode().trim_end()), Some(sensed));
        }

        #[test]
        fn no_line_makes_the_decoder_panic(line in "(sensed )?\\PC{0,60}") {
            Sensed::decode(&line);
        }
    }

    #[test]
    fn what_is_damaged_or_no_number_is_no_sample() {
        let sealed = |body: &str| format!("{body}*{:08x}", crc32fast::hash(body.as_bytes()));
        assert!(Sensed::decode(&sealed("sensed 1 2 0.5")).is_some());
        for body in ["sensed 1 2", "sensed 1 2 inf", "sensed x 2 0.5", "1 ok"] {
            assert_eq!(Sensed::decode(&sealed(body)), None, "{body}");
        }
        assert_eq!(Sensed::decode("sensed 1 2 0.5*00000000"), None);
    }
}
