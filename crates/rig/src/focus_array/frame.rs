//! A drive frame: what each channel of a controller does for some periods of the carrier.
//!
//! The same type is what a display is made of, what goes over the wire, and what a simulator takes its amplitudes and
//! phases from: whatever the controller's clock and levels round away is gone in all three.

use std::fmt::Write as _;
use std::num::NonZeroU32;

use super::ArrayIdentity;

/// The level of a channel that is driven with the whole carrier.
pub const FULL_LEVEL: u8 = 255;

/// Why a frame does not fit a controller.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrameFault {
    /// Channels for another number of elements than the array has.
    #[error("it has {has} elements, and a frame for {given} was given")]
    Channels {
        /// Elements of the array.
        has: usize,
        /// Channels given.
        given: usize,
    },
    /// A delay that is not within the carrier's period.
    #[error("a delay is 0 to {most} clock steps, or - for a silent channel, not `{word}`")]
    Delay {
        /// The largest delay.
        most: u32,
        /// What was given.
        word: String,
    },
    /// A level that is none.
    #[error("a level is 0 to {FULL_LEVEL}, not `{word}`")]
    Level {
        /// What was given.
        word: String,
    },
    /// A frame that lasts no time.
    #[error("a frame is held for 1 to {} periods of the carrier, not `{word}`", u32::MAX)]
    Hold {
        /// What was given.
        word: String,
    },
}

/// What one channel does: its pulses start `delay_steps` after the common trigger, at a level of the carrier's fundamental.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Channel {
    /// Clock steps, below the period's.
    pub delay_steps: u32,
    /// Amplitude of the fundamental in parts of [`FULL_LEVEL`]; 0 is silent.
    pub level: u8,
}

/// A square pulse in each period of the carrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pulse {
    /// Clock steps from the common trigger to its rise, below the period's.
    pub start_steps: u32,
    /// Clock steps that it lasts, at most half a period.
    pub width_steps: u32,
}

/// The fundamental of a channel's pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fundamental {
    /// Relative to that of pulses of half a period, 0 to 1.
    pub amplitude: f64,
    /// How late it is, clock steps; not whole where a pulse of an odd width cannot stand symmetrically.
    pub delay_steps: f64,
}

impl Channel {
    /// A channel that does not sound.
    pub const SILENT: Self = Self { delay_steps: 0, level: 0 };

    /// The pulses that the controller makes of it under an envelope's level; `None` where it is silent.
    ///
    /// A pulse of width w in a period P has a fundamental of sin(πw/P) (its Fourier coefficient over that of w = P/2), so
    /// w = P/π asin(level), to the nearest step. It stands in the middle of the half period that a full pulse would fill.
    pub fn pulse(self, envelope: u8, period_steps: u32) -> Option<Pulse> {
        let full = f64::from(FULL_LEVEL);
        let amplitude = f64::from(self.level) / full * (f64::from(envelope) / full);
        let width =
            (f64::from(period_steps) / std::f64::consts::PI * amplitude.asin()).round() as u32;
        let width_steps = width.min(period_steps / 2);
        let start_steps = (self.delay_steps + (period_steps / 2 - width_steps) / 2) % period_steps;
        (width_steps > 0).then_some(Pulse { start_steps, width_steps })
    }

    fn word(self) -> String {
        match self.level {
            0 => "-".to_owned(),
            FULL_LEVEL => self.delay_steps.to_string(),
            level => format!("{}:{level}", self.delay_steps),
        }
    }

    fn parse(word: &str, period_steps: u32) -> Result<Self, FrameFault> {
        if word == "-" {
            return Ok(Self::SILENT);
        }
        let (delay, level) = match word.split_once(':') {
            Some((delay, level)) => {
                let wrong = || FrameFault::Level { word: word.to_owned() };
                (delay, level.parse().map_err(|_| wrong())?)
            }
            None => (word, FULL_LEVEL),
        };
        let delay_steps =
            delay.parse().ok().filter(|&steps: &u32| steps < period_steps).ok_or_else(|| {
                FrameFault::Delay { most: period_steps.saturating_sub(1), word: word.to_owned() }
            })?;
        // Only one form for a silent channel, so that equal frames are equal.
        Ok(if level == 0 { Self::SILENT } else { Self { delay_steps, level } })
    }
}

impl Pulse {
    /// Its fundamental.
    pub fn fundamental(self, period_steps: u32) -> Fundamental {
        let period = f64::from(period_steps);
        let width = f64::from(self.width_steps);
        Fundamental {
            amplitude: (std::f64::consts::PI * width / period).sin(),
            delay_steps: f64::from(self.start_steps) + width / 2.0 - period / 4.0,
        }
    }
}

/// What every channel does, and for how long.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct DriveFrame {
    channels: Vec<Channel>,
    hold_periods: NonZeroU32,
}

impl DriveFrame {
    /// A frame of phases (radians; later is larger) and amplitudes (0 to 1 of the carrier), each to the nearest step and level
    /// that the controller has.
    ///
    /// # Errors
    /// [`FrameFault::Channels`] for another number of elements than the controller's.
    pub fn nearest(
        controller: &ArrayIdentity,
        drives: impl IntoIterator<Item = (f64, f64)>,
        hold_periods: NonZeroU32,
    ) -> Result<Self, FrameFault> {
        let period = f64::from(controller.period_steps);
        let channels: Vec<Channel> = drives
            .into_iter()
            .map(|(phase_rad, amplitude)| {
                let turns = (phase_rad / std::f64::consts::TAU).rem_euclid(1.0);
                let level = (amplitude.clamp(0.0, 1.0) * f64::from(FULL_LEVEL)).round() as u8;
                let delay_steps = (turns * period).round() as u32 % controller.period_steps;
                if level == 0 { Channel::SILENT } else { Channel { delay_steps, level } }
            })
            .collect();
        if channels.len() != controller.elements {
            let (has, given) = (controller.elements, channels.len());
            return Err(FrameFault::Channels { has, given });
        }
        Ok(Self { channels, hold_periods })
    }

    /// What each channel does.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Periods of the carrier for which it is held.
    pub fn hold_periods(&self) -> NonZeroU32 {
        self.hold_periods
    }

    /// The same for longer, or `None` beyond what a controller counts.
    pub fn held_longer(&self, by_periods: NonZeroU32) -> Option<Self> {
        let hold_periods = self.hold_periods.checked_add(by_periods.get())?;
        Some(Self { channels: self.channels.clone(), hold_periods })
    }

    /// The fundamental of each channel under an envelope's level; `None` where it is silent.
    pub fn fundamentals(
        &self,
        envelope: u8,
        period_steps: u32,
    ) -> impl Iterator<Item = Option<Fundamental>> {
        self.channels.iter().map(move |channel| {
            channel.pulse(envelope, period_steps).map(|pulse| pulse.fundamental(period_steps))
        })
    }

    /// As fields of the wire: the periods that it is held, then the channels.
    pub fn encode(&self) -> String {
        let mut words = self.hold_periods.to_string();
        for channel in &self.channels {
            write!(words, " {}", channel.word()).expect("a string takes all");
        }
        words
    }

    /// Reads the fields of the wire for a controller of so many elements and clock steps in a period.
    ///
    /// # Errors
    /// The first word that does not fit.
    pub fn decode<'a>(
        words: impl IntoIterator<Item = &'a str>,
        elements: usize,
        period_steps: u32,
    ) -> Result<Self, FrameFault> {
        let mut words = words.into_iter();
        let hold = words.next().unwrap_or_default();
        let hold_periods = hold.parse().map_err(|_| FrameFault::Hold { word: hold.to_owned() })?;
        let channels =
            words.map(|word| Channel::parse(word, period_steps)).collect::<Result<Vec<_>, _>>()?;
        if channels.len() != elements {
            return Err(FrameFault::Channels { has: elements, given: channels.len() });
        }
        Ok(Self { channels, hold_periods })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use num_complex::Complex64;
    use proptest::prelude::*;

    use super::*;

    fn controller(elements: usize, period_steps: u32) -> ArrayIdentity {
        ArrayIdentity { period_steps, ..ArrayIdentity::of_thesis(elements, 40e3) }
    }

    proptest! {
        #[test]
        fn what_is_sent_is_what_is_read(
            drives in prop::collection::vec((-9.0..9.0f64, -0.2..1.2f64), 1..60),
            hold in 1u32.., period_steps in 8u32..1024,
        ) {
            let hold = NonZeroU32::new(hold).expect("above zero");
            let count = drives.len();
            let frame = DriveFrame::nearest(&controller(count, period_steps), drives, hold).expect("fits");
            let words = frame.encode();
            let read = DriveFrame::decode(words.split(' '), count, period_steps);
            prop_assert_eq!(read.expect("its own words"), frame);
        }

        #[test]
        fn no_words_make_the_decoder_panic(words in prop::collection::vec("[-0-9:.a]{0,6}", 0..9)) {
            let read = DriveFrame::decode(words.iter().map(String::as_str), 3, 256);
            if let Ok(frame) = read {
                prop_assert_eq!(frame.channels().len(), 3);
            }
        }

        #[test]
        fn a_phase_errs_by_half_a_step_at_most(phase in -20.0..20.0f64, period_steps in prop_oneof![Just(16u32), Just(256)]) {
            let frame = DriveFrame::nearest(&controller(1, period_steps), [(phase, 1.0)], NonZeroU32::MIN).expect("fits");
            let sent = frame.fundamentals(255, period_steps).next().flatten().expect("it sounds");
            let turned = Complex64::from_polar(1.0, TAU * sent.delay_steps / f64::from(period_steps) - phase);
            prop_assert!(turned.arg().abs() <= PI / f64::from(period_steps) + 1e-9);
            prop_assert!((sent.amplitude - 1.0).abs() < 1e-12);
        }

        #[test]
        fn a_fundamental_is_the_fourier_coefficient_of_its_pulse(
            delay_steps in 0u32..256, level: u8, envelope: u8,
        ) {
            let Some(pulse) = (Channel { delay_steps, level }).pulse(envelope, 256) else { return Ok(()) };
            // By its definition, each step of the clock exactly integrated.
            let coefficient: Complex64 = (pulse.start_steps..pulse.start_steps + pulse.width_steps)
                .map(|step| {
                    let edge = |step: u32| Complex64::from_polar(1.0, TAU * f64::from(step) / 256.0);
                    (edge(step + 1) - edge(step)) / Complex64::new(0.0, 2.0)
                })
                .sum();
            let fundamental = pulse.fundamental(256);
            // That of half a period from 0 on is 1 at a quarter of a turn.
            let stated = Complex64::from_polar(fundamental.amplitude, TAU * (fundamental.delay_steps / 256.0 + 0.25));
            prop_assert!((coefficient - stated).norm() < 1e-12, "{} {}", coefficient, stated);
            // Half a step of width is the most that the amplitude errs; half a step of time the delay.
            let asked = f64::from(level) * f64::from(envelope) / (255.0 * 255.0);
            prop_assert!((fundamental.amplitude - asked).abs() <= PI / 512.0 + 1e-12);
            let late = (fundamental.delay_steps - f64::from(delay_steps)).rem_euclid(256.0);
            prop_assert!(late.min(256.0 - late) <= 0.5 + 1e-9, "{}", late);
        }
    }

    #[test]
    fn a_wrong_word_is_named() {
        let read = |words: &str| {
            DriveFrame::decode(words.split(' '), 2, 256).map_err(|fault| fault.to_string())
        };
        assert!(read("40 0 255:7").is_ok());
        insta::assert_snapshot!(
            ["40 0", "40 0 256", "40 0 1:256", "40 0 x", "0 1 2", "", "40 1 2 3"]
                .map(|words| format!("{words}: {}", read(words).expect_err("wrong")))
                .join("\n"),
            @r"
        40 0: it has 2 elements, and a frame for 1 was given
        40 0 256: a delay is 0 to 255 clock steps, or - for a silent channel, not `256`
        40 0 1:256: a level is 0 to 255, not `1:256`
        40 0 x: a delay is 0 to 255 clock steps, or - for a silent channel, not `x`
        0 1 2: a frame is held for 1 to 4294967295 periods of the carrier, not `0`
        : a frame is held for 1 to 4294967295 periods of the carrier, not ``
        40 1 2 3: it has 2 elements, and a frame for 3 was given
        "
        );
    }
}
