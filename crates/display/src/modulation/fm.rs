//! Frequency modulation of the envelope.
//!
//! The frequency of the envelope is f + Δ cos(2π s t) with the mean f, the deviation Δ and the sweep frequency s. Its phase is
//! f t + Δ/(2π s) sin(2π s t) cycles. The spectrum has lines at f + n s with amplitudes J_n(Δ/s) (Carson, *Proc. IRE* 10, 57,
//! 1922). The line at f itself vanishes for some deviations, although the sensation does not.

use std::f64::consts::TAU;
use std::num::NonZeroU32;

use serde::Deserialize;

use super::{LEAST_LEVELS, Waveform, full_depth};
use crate::error::DisplayError;
use fieldgap_input::{Fraction, Rate};

/// `[modulation.fm]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fm {
    /// Mean frequency, Hz.
    pub frequency_hz: Rate,
    /// Deviation of the frequency, Hz.
    pub deviation_hz: Rate,
    /// Sweep frequency, Hz. It is rounded so that a sweep has a whole number of cycles.
    pub sweep_hz: Rate,
    /// Depth, 0 (no modulation) to 1 (down to zero).
    #[serde(default = "full_depth")]
    pub depth: Fraction,
    /// Waveform.
    #[serde(default)]
    pub waveform: Waveform,
}

/// A frequency sweep as played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Cycles per sweep.
    pub cycles: u32,
    /// Levels of the envelope per sweep.
    pub(super) levels: u32,
    /// Carrier periods per level.
    pub(super) hold: NonZeroU32,
    /// Deviation over the mean frequency.
    pub swing: f64,
}

impl Fm {
    /// The sweep for a controller that stores `most` levels.
    ///
    /// # Errors
    /// [`DisplayError::TooFast`] if its fastest cycle has fewer than eight levels; [`DisplayError::Sweep`] if the frequency
    /// would reach zero, or a sweep is shorter than a cycle.
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
        let fastest_levels = levels / cycles / (1.0 + swing);
        if fastest_levels < LEAST_LEVELS {
            return Err(DisplayError::TooFast {
                frequency_hz: fastest_hz,
                periods: fastest_levels,
                least: LEAST_LEVELS,
            });
        }
        let hold = NonZeroU32::new(hold as u32).expect("at least one");
        Ok(Sweep { cycles: cycles as u32, levels: levels as u32, hold, swing })
    }
}

impl Sweep {
    /// Mean frequency, Hz.
    pub fn mean_hz(&self, carrier_hz: f64) -> f64 {
        carrier_hz * f64::from(self.cycles) / self.periods()
    }

    /// Phase in cycles at a time in carrier periods.
    pub fn turns(&self, period: f64) -> f64 {
        let cycles = f64::from(self.cycles);
        let sweeps = period / self.periods();
        cycles * (sweeps + self.swing / TAU * (TAU * sweeps).sin())
    }

    fn periods(&self) -> f64 {
        f64::from(self.levels) * f64::from(self.hold.get())
    }
}
