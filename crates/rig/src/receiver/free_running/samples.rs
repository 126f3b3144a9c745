//! The samples among the bytes of a receiver that sends without being asked.

use super::super::binary::FrameDecoder;
use super::super::config::{FreeRunningConfig, Lines};
use super::super::protocol::Event;
use super::super::reading::{is_possible, is_possible_sample};

/// More bytes than this without a line end are noise.
const LONGEST_LINE: usize = 4096;

/// Two samples further apart than this many periods have a damaged time between them, or a restart.
const MOST_PERIODS: f64 = 50.0;

/// Two samples closer than this share of a period have a damaged time between them.
const LEAST_PERIODS: f64 = 0.2;

/// Samples in a row with a time that cannot be, after which their time is accepted.
const MOST_IMPLAUSIBLE: u32 = 3;

/// One sample, with the receiver's time as it was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub(super) t_us: u64,
    pub(super) value: f64,
    pub(super) clipped: bool,
}

/// Finds samples in bytes, however they are cut.
#[derive(Debug)]
pub(super) struct SampleDecoder {
    lines: Lines,
    column: usize,
    rate_hz: f64,
    full_scale: f64,
    frames: FrameDecoder,
    pending: Vec<u8>,
    /// Samples without a time of their own that were read so far.
    counted: u64,
    /// The last line that is no sample, if none came since.
    pub(super) unreadable: Option<String>,
}

impl SampleDecoder {
    pub(super) fn new(config: &FreeRunningConfig) -> Self {
        Self {
            lines: config.lines,
            column: config.column.get(),
            rate_hz: config.rate_hz.get(),
            full_scale: config.full_scale.get(),
            frames: FrameDecoder::default(),
            pending: Vec::new(),
            counted: 0,
            unreadable: None,
        }
    }

    /// Takes bytes; the samples that they complete.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<Sample> {
        if self.lines == Lines::Frames {
            return self.samples_of_frames(bytes);
        }
        self.pending.extend_from_slice(bytes);
        let Some(end) = self.pending.iter().rposition(|&byte| byte == b'\n') else {
            if self.pending.len() > LONGEST_LINE {
                self.unreadable = Some(printable(&self.pending));
                self.pending.clear();
            }
            return Vec::new();
        };
        let whole: Vec<u8> = self.pending.drain(..=end).collect();
        let lines = whole.split(|&byte| byte == b'\n').filter(|line| !line.trim_ascii().is_empty());
        lines.filter_map(|line| self.sample_in(line)).collect()
    }

    fn samples_of_frames(&mut self, bytes: &[u8]) -> Vec<Sample> {
        self.frames.push(bytes);
        let mut samples = Vec::new();
        while let Some(event) = self.frames.next_event() {
            if let Event::Sample(sample) = event
                && is_possible_sample(&sample, self.full_scale)
            {
                let value = sample.quadrature.map_or(sample.value, |q| sample.value.hypot(q));
                let clipped = sample.clipped || value.abs() >= self.full_scale;
                samples.push(Sample { t_us: sample.t_us, value, clipped });
            }
        }
        self.unreadable = samples.is_empty().then(|| "no frame among the bytes".to_owned());
        samples
    }

    fn sample_in(&mut self, line: &[u8]) -> Option<Sample> {
        let text = String::from_utf8_lossy(line);
        let sample = match self.lines {
            Lines::TimeAndValue => parse(text.trim(), self.full_scale),
            _ => number_in(text.trim(), self.column).map(|value| {
                self.counted += 1;
                let t_us = (self.counted as f64 * 1e6 / self.rate_hz).round() as u64;
                Sample { t_us, value, clipped: value.abs() >= self.full_scale }
            }),
        };
        let sample = sample.filter(|sample| is_possible(sample.value, self.full_scale));
        self.unreadable = sample.is_none().then(|| printable(line));
        sample
    }
}

/// The receiver's time without wraps and without damaged stamps.
#[derive(Debug)]
pub(super) struct Unwrapped {
    period_us: f64,
    last: Option<(Sample, f64)>,
    implausible: u32,
}

/// What became of a sample's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stamp {
    /// Its time, s.
    Time(f64),
    /// Its time, s, after a jump of the clock; not comparable with those before.
    Jump(f64),
    /// Its time is damaged.
    Damaged,
}

impl Unwrapped {
    pub(super) fn new(rate_hz: f64) -> Self {
        Self { period_us: 1e6 / rate_hz, last: None, implausible: 0 }
    }

    pub(super) fn stamp(&mut self, sample: Sample) -> Stamp {
        let Some((last, last_s)) = self.last else {
            let t_s = sample.t_us as f64 * 1e-6;
            self.last = Some((sample, t_s));
            return Stamp::Time(t_s);
        };
        let elapsed_us = elapsed_us(last.t_us, sample.t_us);
        if (LEAST_PERIODS..MOST_PERIODS).contains(&(elapsed_us / self.period_us)) {
            let t_s = last_s + elapsed_us * 1e-6;
            self.last = Some((sample, t_s));
            self.implausible = 0;
            return Stamp::Time(t_s);
        }
        self.implausible += 1;
        if self.implausible <= MOST_IMPLAUSIBLE {
            return Stamp::Damaged;
        }
        // It is the one before that was damaged, or the receiver restarted.
        self.implausible = 0;
        let t_s = last_s + self.period_us * 1e-6;
        self.last = Some((sample, t_s));
        Stamp::Jump(t_s)
    }
}

fn printable(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim().escape_debug().take(100).collect()
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
pub(super) fn elapsed_us(from_us: u64, to_us: u64) -> f64 {
    match (u32::try_from(from_us), u32::try_from(to_us)) {
        (Ok(from), Ok(to)) => f64::from(to.wrapping_sub(from)),
        _ => to_us as f64 - from_us as f64,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::config;
    use super::*;

    #[test]
    fn a_value_at_full_scale_is_clipped() {
        assert_eq!(parse("12 -5.0", 5.0), Some(Sample { t_us: 12, value: -5.0, clipped: true }));
        assert_eq!(parse("12 4.9", 5.0), Some(Sample { t_us: 12, value: 4.9, clipped: false }));
        for bad in ["12", "x 1", "12 nan", "12 1 ?", "12 1 ! 3"] {
            assert_eq!(parse(bad, 5.0), None, "{bad}");
        }
    }

    #[test]
    fn a_value_that_the_converter_cannot_give_is_no_sample() {
        for (lines, line) in
            [(Lines::TimeAndValue, "12 1e160\n13 1.0\n"), (Lines::Value, "9.99\n1.0\n")]
        {
            let config = FreeRunningConfig { lines, ..config() };
            let samples = SampleDecoder::new(&config).push(line.as_bytes());
            let values: Vec<f64> = samples.iter().map(|sample| sample.value).collect();
            assert_eq!(values, [1.0], "{lines:?}");
        }
    }

    #[test]
    fn a_damaged_time_costs_that_sample_alone() {
        let mut unwrapped = Unwrapped::new(1000.0);
        let sample = |t_us: u64| Sample { t_us, value: 1.0, clipped: false };
        let stamps: Vec<Stamp> = [5_000_000, 5_001_000, 9_002_000, 5_003_000]
            .map(|t_us| unwrapped.stamp(sample(t_us)))
            .into();
        assert!(
            matches!(stamps[..], [Stamp::Time(_), Stamp::Time(_), Stamp::Damaged, Stamp::Time(t_s)]
            if (t_s - 5.003).abs() < 1e-9)
        );
    }

    #[test]
    fn a_restart_is_a_jump_after_a_few_samples() {
        let mut unwrapped = Unwrapped::new(1000.0);
        let sample = |t_us: u64| Sample { t_us, value: 1.0, clipped: false };
        unwrapped.stamp(sample(5_000_000));
        let stamps: Vec<Stamp> =
            (1..6).map(|number| unwrapped.stamp(sample(number * 1000))).collect();
        assert!(matches!(
            stamps[..],
            [Stamp::Damaged, Stamp::Damaged, Stamp::Damaged, Stamp::Jump(_), Stamp::Time(_)]
        ));
    }

    proptest! {
        #[test]
        fn no_line_makes_the_parser_panic(line in "\\PC{0,40}") {
            let _ = parse(&line, 5.0);
            let _ = number_in(&line, 2);
        }
    }
}
