//! The virtual counterparts of boards that never answer: they turn bytes into delays.
//!
//! They power up as the real ones do: most of them emit at once.

mod sonic_surface;
mod ultraino;

use std::sync::Arc;

use serde::Deserialize;

use super::array_firmware::ArrayFirmware;
use super::drive::Drive;
use super::firmware::Firmware;
use super::world::World;
use fieldgap_rig::focus_array::{UltrainoModel, sonic_surface_channels};
use sonic_surface::{Dialect, SonicSurfaceBoards};
use ultraino::UltrainoChain;

/// Carrier that the boards make, Hz.
const CARRIER_HZ: f64 = 40e3;

/// `[virtual.array]`: which controller drives the virtual array, and how it is truly wired.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ArraySettings {
    /// The controller.
    pub controller: Controller,
    /// Boards in the chain.
    pub boards: std::num::NonZeroUsize,
    /// The channel that each element is truly wired to. Absent: the maker's numbering, or the order of the elements where the array
    /// has another number of them.
    pub channels: Option<Vec<usize>>,
    /// Steps that the thesis's controller divides a period of the carrier into. Absent: its own 256.
    pub period_steps: Option<std::num::NonZeroU32>,
}

/// The known controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Controller {
    /// The thesis's.
    #[default]
    Thesis,
    /// SonicSurface with the firmware that its makers publish.
    SonicSurface,
    /// SonicSurface with the firmware that modulates.
    SonicSurfaceTactile,
    /// Ultraino's Arduino MEGA.
    UltrainoMega,
    /// Ultraino's Arduino Nano.
    UltrainoNano,
    /// Ultraino's DriverNano16.
    UltrainoNano16,
}

impl Default for ArraySettings {
    fn default() -> Self {
        Self {
            controller: Controller::Thesis,
            boards: std::num::NonZeroUsize::MIN,
            channels: None,
            period_steps: None,
        }
    }
}

/// The firmware of the settings, for an array of so many elements.
pub(super) fn firmware(
    settings: &ArraySettings,
    elements: usize,
    frequency_hz: f64,
    world: Arc<World>,
) -> Box<dyn Firmware> {
    let boards = settings.boards.get();
    let on = |by_maker: Vec<usize>| {
        let in_order = || match by_maker.len() == elements {
            true => by_maker,
            false => (0..elements).collect(),
        };
        let channels = settings.channels.clone().unwrap_or_else(in_order);
        Wired { channels, elements, world: world.clone() }
    };
    let ultraino = |model: UltrainoModel| {
        let wired = on(model.wired(boards));
        Box::new(UltrainoChain::new(model, boards, wired)) as Box<dyn Firmware>
    };
    let sonic_surface = |dialect| {
        let wired = on(sonic_surface_channels(boards));
        Box::new(SonicSurfaceBoards::new(dialect, boards, wired)) as Box<dyn Firmware>
    };
    match settings.controller {
        Controller::Thesis => {
            let firmware = ArrayFirmware::new(elements, frequency_hz, world.clone());
            Box::new(match settings.period_steps {
                Some(steps) => firmware.with_period_steps(steps.get()),
                None => firmware,
            })
        }
        Controller::SonicSurface => sonic_surface(Dialect::Open),
        Controller::SonicSurfaceTactile => sonic_surface(Dialect::Tactile),
        Controller::UltrainoMega => ultraino(UltrainoModel::Mega),
        Controller::UltrainoNano => ultraino(UltrainoModel::Nano),
        Controller::UltrainoNano16 => ultraino(UltrainoModel::Nano16),
    }
}

/// The waveform of one channel's pin in each period.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PinPulse {
    /// Delay of its fundamental relative to that of a pulse from 0 to half a period, in periods.
    late_periods: f64,
    /// Amplitude of its fundamental, relative to that of a pulse of half a period.
    amplitude: f64,
}

impl PinPulse {
    /// High from `start` on for `width`, both in periods.
    ///
    /// The fundamental is centred on the pulse, and proportional to the sine of half its width in radians.
    fn new(start: f64, width: f64) -> Self {
        Self {
            late_periods: start + (width - 0.5) / 2.0,
            amplitude: (std::f64::consts::PI * width).sin(),
        }
    }
}

/// The elements on the channels' pins.
struct Wired {
    /// The channel of each element.
    channels: Vec<usize>,
    elements: usize,
    world: Arc<World>,
}

impl Wired {
    /// Sets the pins' waveforms from `now_s` on.
    fn drive(&self, now_s: f64, duty: f64, pin: impl Fn(usize) -> Option<PinPulse>) {
        let pulses: Vec<Option<PinPulse>> = (0..self.elements)
            .map(|element| self.channels.get(element).and_then(|&channel| pin(channel)))
            .collect();
        let late_s = |pulse: &PinPulse| pulse.late_periods / CARRIER_HZ;
        self.world.drive(
            now_s,
            Drive {
                emitting: true,
                delays_s: pulses.iter().map(|pulse| pulse.as_ref().map(late_s)).collect(),
                amplitudes: pulses.iter().map(|pulse| pulse.map_or(0.0, |p| p.amplitude)).collect(),
                duty,
                ..Drive::silent(self.elements)
            },
        );
    }
}
