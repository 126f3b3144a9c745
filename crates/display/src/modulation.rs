//! Modulations that make a focus perceptible: an envelope of the whole array, or a movement of the focus.

mod fm;

use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use super::error::DisplayError;
use super::path::Direction;
use fieldgap_input::{Exact, Finite, Fraction, Length, Rate};
use fieldgap_rig::config::Percent;
use fieldgap_rig::focus_array::{Envelope, FULL_LEVEL};
pub use fm::{Fm, Sweep};

/// Fewest levels per cycle that represent a waveform.
const LEAST_LEVELS: f64 = 8.0;

/// Most cycles in an envelope: more cycles approximate a frequency better.
const MOST_CYCLES: u32 = 64;

/// Sufficient relative accuracy of a frequency.
const FREQUENCY_TOLERANCE: f64 = 1e-6;

/// `[modulation.…]`; without it the display is a continuous wave.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Modulation {
    /// The amplitude follows a waveform.
    Am(Am),
    /// The amplitude follows a waveform of swept frequency.
    Fm(Fm),
    /// The array is on for a part of each cycle.
    Pwm(Pwm),
    /// The focus oscillates about its position.
    Lateral(Lateral),
    /// The focus runs repeatedly along its path.
    Spatiotemporal(Spatiotemporal),
}

/// `[modulation.am]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Am {
    /// Frequency, Hz.
    pub frequency_hz: Rate,
    /// Depth, 0 (no modulation) to 1 (down to zero).
    #[serde(default = "full_depth")]
    pub depth: Fraction,
    /// Waveform.
    #[serde(default)]
    pub waveform: Waveform,
    /// Quantity that follows the waveform.
    #[serde(default)]
    pub of: Of,
}

/// `[modulation.pwm]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pwm {
    /// Frequency, Hz.
    pub frequency_hz: Rate,
    /// Duty cycle, percent.
    pub duty_percent: Percent,
}

/// `[modulation.lateral]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lateral {
    /// Frequency of the oscillation, Hz.
    pub frequency_hz: Rate,
    /// Amplitude, mm.
    pub amplitude_mm: Length,
    /// Direction of the oscillation.
    #[serde(default = "along_x")]
    pub along: Direction,
}

/// `[modulation.spatiotemporal]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spatiotemporal {
    /// Loops per second, Hz.
    pub frequency_hz: Rate,
}

/// The shape of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Waveform {
    /// A sine.
    #[default]
    Sine,
    /// A square wave.
    Square,
    /// A triangle wave.
    Triangle,
    /// A sawtooth: linear rise, immediate fall.
    Sawtooth,
}

/// Quantity that follows the waveform of an amplitude modulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Of {
    /// The sound pressure. The force, its square, then also has the second harmonic.
    #[default]
    Pressure,
    /// The force. The sound pressure follows its square root.
    Force,
}

fn full_depth() -> Fraction {
    Fraction::new(1.0).expect("one is in range")
}

fn along_x() -> Direction {
    let axis = [1.0, 0.0, 0.0].map(|part| Finite::new(part).expect("a literal"));
    Exact::from(axis).try_into().expect("not zero")
}

impl Waveform {
    /// Its value at a phase in cycles, -1 to 1.
    pub fn at(self, turns: f64) -> f64 {
        let turns = turns.rem_euclid(1.0);
        match self {
            Self::Sine => (std::f64::consts::TAU * turns).sin(),
            Self::Square => {
                if turns < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
            Self::Triangle => 1.0 - 4.0 * (0.5 - (turns + 0.25).rem_euclid(1.0)).abs(),
            Self::Sawtooth => 2.0 * turns - 1.0,
        }
    }
}

impl Modulation {
    /// Frequency, Hz; the mean if it is swept.
    pub fn frequency_hz(&self) -> f64 {
        match self {
            Self::Am(am) => am.frequency_hz.get(),
            Self::Fm(fm) => fm.frequency_hz.get(),
            Self::Pwm(pwm) => pwm.frequency_hz.get(),
            Self::Lateral(lateral) => lateral.frequency_hz.get(),
            Self::Spatiotemporal(spatiotemporal) => spatiotemporal.frequency_hz.get(),
        }
    }

    /// The amplitude at a phase in cycles, 0 to 1: (1 + m w)/(1 + m) for depth m and waveform w; 1 for movements.
    pub fn amplitude_at(&self, turns: f64) -> f64 {
        match self {
            Self::Fm(fm) => shaped(fm.depth, fm.waveform, turns),
            Self::Am(am) => {
                let shaped = shaped(am.depth, am.waveform, turns);
                match am.of {
                    Of::Pressure => shaped,
                    Of::Force => shaped.max(0.0).sqrt(),
                }
            }
            Self::Pwm(pwm) => {
                if turns.rem_euclid(1.0) < pwm.duty_percent.get() / 100.0 {
                    1.0
                } else {
                    0.0
                }
            }
            Self::Lateral(_) | Self::Spatiotemporal(_) => 1.0,
        }
    }

    /// Its frequency sweep, if it has one.
    ///
    /// # Errors
    /// As [`Fm::sweep`].
    pub fn sweep(&self, carrier_hz: f64, most: usize) -> Result<Option<Sweep>, DisplayError> {
        match self {
            Self::Fm(fm) => fm.sweep(carrier_hz, most).map(Some),
            _ => Ok(None),
        }
    }

    /// The envelope for a controller that stores `most` levels.
    ///
    /// Its loop has the fewest cycles that approximate the frequency to a millionth, or one sweep; see [`Modulation::achieved_hz`].
    ///
    /// # Errors
    /// [`DisplayError::TooFast`] above an eighth of the carrier; and as [`Fm::sweep`].
    pub fn envelope(&self, carrier_hz: f64, most: usize) -> Result<Envelope, DisplayError> {
        if matches!(self, Self::Lateral(_) | Self::Spatiotemporal(_)) {
            return Ok(Envelope::continuous());
        }
        let level = |amplitude: f64| (amplitude * f64::from(FULL_LEVEL)).round() as u8;
        if let Some(sweep) = self.sweep(carrier_hz, most)? {
            let middle = |n: u32| (f64::from(n) + 0.5) * f64::from(sweep.hold.get());
            let levels = (0..sweep.levels).map(|n| self.amplitude_at(sweep.turns(middle(n))));
            return Ok(Envelope::new(levels.map(level).collect(), sweep.hold)?);
        }
        let timing = CycleTiming::nearest(self.frequency_hz(), carrier_hz, most)?;
        let levels = (0..timing.levels)
            .map(|n| {
                let turns = (f64::from(n) + 0.5) / f64::from(timing.levels);
                level(self.amplitude_at(turns * f64::from(timing.cycles)))
            })
            .collect();
        Ok(Envelope::new(levels, timing.hold)?)
    }

    /// The achieved frequency of its envelope, Hz; the requested one for movements.
    ///
    /// # Errors
    /// As [`Modulation::envelope`].
    pub fn achieved_hz(&self, carrier_hz: f64, most: usize) -> Result<f64, DisplayError> {
        match self {
            Self::Am(_) | Self::Pwm(_) => {
                Ok(CycleTiming::nearest(self.frequency_hz(), carrier_hz, most)?
                    .frequency_hz(carrier_hz))
            }
            Self::Fm(fm) => Ok(fm.sweep(carrier_hz, most)?.mean_hz(carrier_hz)),
            Self::Lateral(_) | Self::Spatiotemporal(_) => Ok(self.frequency_hz()),
        }
    }
}

/// (1 + m w)/(1 + m) for a depth m and a waveform w.
fn shaped(depth: Fraction, waveform: Waveform, turns: f64) -> f64 {
    let depth = depth.get();
    (1.0 + depth * waveform.at(turns)) / (1.0 + depth)
}

/// An envelope of whole cycles; each level is held for some carrier periods.
#[derive(Debug, Clone, Copy)]
struct CycleTiming {
    cycles: u32,
    levels: u32,
    hold: NonZeroU32,
}

impl CycleTiming {
    fn frequency_hz(self, carrier_hz: f64) -> f64 {
        carrier_hz * f64::from(self.cycles) / (f64::from(self.levels) * f64::from(self.hold.get()))
    }

    fn nearest(frequency_hz: f64, carrier_hz: f64, most: usize) -> Result<Self, DisplayError> {
        let cycle_periods = carrier_hz / frequency_hz;
        if cycle_periods < LEAST_LEVELS {
            let least = LEAST_LEVELS;
            return Err(DisplayError::TooFast { frequency_hz, periods: cycle_periods, least });
        }
        let most = most.max(LEAST_LEVELS as usize) as f64;
        let mut best: Option<(f64, Self)> = None;
        for cycles in 1..=MOST_CYCLES {
            let periods = cycle_periods * f64::from(cycles);
            // As many levels as possible, but enough for each cycle.
            let hold = (periods / most).ceil().max(1.0);
            let levels = (periods / hold).round().min(most);
            if levels < LEAST_LEVELS * f64::from(cycles) || hold > f64::from(u32::MAX) {
                break;
            }
            let hold = NonZeroU32::new(hold as u32).expect("at least one");
            let timing = Self { cycles, levels: levels as u32, hold };
            let error = (timing.frequency_hz(carrier_hz) / frequency_hz - 1.0).abs();
            if best.is_none_or(|(least, _)| error < least) {
                best = Some((error, timing));
            }
            if error < FREQUENCY_TOLERANCE {
                break;
            }
        }
        let none =
            DisplayError::TooFast { frequency_hz, periods: cycle_periods, least: LEAST_LEVELS };
        best.map(|(_, timing)| timing).ok_or(none)
    }
}

#[cfg(test)]
mod tests;
