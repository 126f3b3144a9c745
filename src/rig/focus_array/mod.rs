//! Phased arrays: what their controllers are told, and the drivers.

mod config;
pub mod protocol;
mod thesis;
#[cfg(test)]
mod thesis_tests;

pub use config::ThesisConfig;
pub use thesis::{Modulation, ThesisArray};

/// When an element emits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementDelay {
    /// So long after the common trigger, s, from zero upwards.
    Seconds(f64),
    /// Not at all.
    Silent,
}

/// What an array's controller says of itself.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ArrayIdentity {
    /// Its name and protocol version.
    pub name: String,
    /// How many elements it drives.
    pub elements: usize,
    /// Rate of the clock that delays are counted in, Hz.
    pub clock_hz: f64,
    /// Clock steps in one period of the carrier: delays are taken modulo this.
    pub period_steps: u32,
}
