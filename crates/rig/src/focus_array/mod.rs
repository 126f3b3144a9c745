//! Phased arrays: the commands of their controllers, and the drivers.

mod config;
mod file_sink;
mod frame;
mod one_way;
mod program;
pub mod protocol;
mod sensed;
mod sonic_surface;
mod thesis;
#[cfg(test)]
mod thesis_tests;
mod ultraino;
mod wiring;

use crate::error::Cause;

pub use crate::error::{ProgramFault, WiringFault};
pub use config::ThesisConfig;
pub use file_sink::FileSinkConfig;
pub use frame::{Channel, DriveFrame, FULL_LEVEL, FrameFault, Fundamental, Pulse};
pub use program::{DriveProgram, Envelope};
pub use sensed::Sensed;
pub use sonic_surface::SonicSurfaceConfig;
pub use sonic_surface::channels_by_position as sonic_surface_channels;
pub use thesis::{Modulation, ThesisArray};
pub use ultraino::{Model as UltrainoModel, UltrainoConfig};

/// What the thesis's controller calls itself, with the version of its protocol.
pub const THESIS_NAME: &str = "thesis-array 1";

/// When an element emits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementDelay {
    /// So long after the common trigger, s, from zero upwards.
    Seconds(f64),
    /// Not at all.
    Silent,
}

impl ElementDelay {
    /// The delay of each element, s; `None` where it is silent.
    ///
    /// # Errors
    /// [`Cause::ElementCount`] for another number than `elements`, [`Cause::BadDelay`] for what is no time.
    pub(crate) fn checked_s(delays: &[Self], elements: usize) -> Result<Vec<Option<f64>>, Cause> {
        if delays.len() != elements {
            return Err(Cause::ElementCount { has: elements, given: delays.len() });
        }
        let checked = |(element, delay): (usize, &Self)| match *delay {
            Self::Silent => Ok(None),
            Self::Seconds(delay_s) if delay_s.is_finite() && delay_s >= 0.0 => Ok(Some(delay_s)),
            Self::Seconds(delay_s) => Err(Cause::BadDelay { element, delay_s }),
        };
        delays.iter().enumerate().map(checked).collect()
    }
}

/// Properties that an array's controller states.
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
    /// Frames of a display that it holds; 0: none.
    pub most_frames: usize,
    /// Levels of a display's envelope that it holds.
    pub most_levels: usize,
    /// Elements that it can receive with at a time; 0: none.
    pub most_sensors: usize,
    /// Whether it answers commands. If not, nothing confirms that they arrived.
    pub acknowledges: bool,
}

impl ArrayIdentity {
    /// The carrier that its clock makes, Hz.
    pub fn carrier_hz(&self) -> f64 {
        self.clock_hz / f64::from(self.period_steps)
    }

    /// The thesis's controller for so many elements and a carrier: 256 clock steps in its period, and memory for displays.
    pub fn of_thesis(elements: usize, carrier_hz: f64) -> Self {
        Self {
            name: THESIS_NAME.to_owned(),
            elements,
            clock_hz: carrier_hz * 256.0,
            period_steps: 256,
            most_frames: 4096,
            most_levels: 4096,
            most_sensors: 4,
            acknowledges: true,
        }
    }
}
