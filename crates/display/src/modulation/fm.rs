//! Frequency modulation: the rate at which the array swells goes up and down.
//!
//! The rate is f + Δ cos(2π s t) for a mean f, a deviation Δ and s sweeps a second, so the phase of the swelling is
//! f t + Δ/(2π s) sin(2π s t) turns. Its spectrum has lines at f + n s, the nth of J_n(Δ/s) of the swelling (Carson, *Proc.
//! IRE* 10, 57, 1922), so the mean rate itself vanishes for some deviations though what is felt does not.

use std::f64::consts::TAU;
use std::num::NonZeroU32;

use serde::Deserialize;

use super::{LEAST_LEVELS, Waveform, whole};
use crate::error::DisplayError;
use fieldgap_input::{Fraction, Positive};

/// `[modulation.fm]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fm {
    /// Cycles a second, the mean, Hz.
    pub frequency_hz: Positive,
    /// How far the rate goes to either side, Hz.
    pub deviation_hz: Positive,
    /// How often a second it goes to and fro, Hz. A sweep holds a whole number of cycles: it is brought to the nearest that does.
    pub sweep_hz: Positive,
    /// How far the amplitude goes down, 0 (no modulation) to 1 (to silence).
    #[serde(default = "whole")]
    pub depth: Fraction,
    /// The shape of a cycle.
    #[serde(default)]
    pub waveform: Waveform,
}

/// A sweep as it is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Cycles in it.
    pub cycles: u32,
    /// Levels of the envelope in it.
    pub(super) levels: u32,
    /// Periods of the carrier that each is held.
    pub(super) hold: NonZeroU32,
    /// Deviation over the mean rate.
    pub swing: f64,
}

impl Fm {
    /// The sweep that a controller of `most` levels makes.
    ///
    /// # Errors
    /// [`DisplayError::TooFast`] where its fastest cycle has fewer than eight levels; [`DisplayError::Sweep`] if the rate would
    /// come to a stand or turn round, or a sweep is shorter than a cycle.
    pub fn sweep(&self, carrier_hz: f64, most: usize) -> Result<Sweep, DisplayError> {
        let (frequency_hz, deviation_hz) = (self.frequency_hz.get(), self.deviation_hz.get());
        let cycles = (frequency_hz / self.sweep_hz.get()).round();
        if deviation_hz >= frequency_hz || cycles < 1.0 || cycles > f64::from(u32::MAX) {
            let sweep_hz = self.sweep_hz.get();
            return Err(DisplayError::Sweep { frequency_hz, deviation_hz, sweep_hz });
        }
        let periods = carrier_hz / frequency_hz * cycles;
        let hold = (periods / most as f64).ceil().max(1.0);
        let levels = (periods / hold).round().min(most as f64);
        let swing = deviation_hz / frequency_hz;
        let fastest_hz = frequency_hz + deviation_hz;
        let of_fastest = levels / cycles / (1.0 + swing);
        if of_fastest < LEAST_LEVELS {
            return Err(DisplayError::TooFast {
                frequency_hz: fastest_hz,
                periods: of_fastest,
                least: LEAST_LEVELS,
            });
        }
        let hold = NonZeroU32::new(hold as u32).expect("at least one");
        Ok(Sweep { cycles: cycles as u32, levels: levels as u32, hold, swing })
    }
}

impl Sweep {
    /// Cycles a second that it has in the mean, Hz.
    pub fn mean_hz(&self, carrier_hz: f64) -> f64 {
        carrier_hz * f64::from(self.cycles) / self.periods()
    }

    /// Cycles that are over at a time, in periods of the carrier.
    pub fn turns(&self, period: f64) -> f64 {
        let cycles = f64::from(self.cycles);
        let sweeps = period / self.periods();
        cycles * (sweeps + self.swing / TAU * (TAU * sweeps).sin())
    }

    fn periods(&self) -> f64 {
        f64::from(self.levels) * f64::from(self.hold.get())
    }
}
