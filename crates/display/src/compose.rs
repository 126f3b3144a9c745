//! From a display file to the drive program of the controller.

use std::collections::HashSet;

use num_complex::Complex64;

use super::error::DisplayError;
use super::file::DisplayFile;
use super::modulation::Sweep;
use super::timeline::{Slot, join};
use fieldgap_acoustics::foci::{Quality, Transfer};
use fieldgap_acoustics::transducer::Transducer;
use fieldgap_acoustics::{Array, Excitation, Medium, Vec3};
use fieldgap_rig::focus_array::{ArrayIdentity, DriveFrame, DriveProgram, Envelope};

/// The array that a display is composed for.
#[derive(Clone, Copy)]
pub struct RadiatingArray<'a> {
    /// Its elements.
    pub array: &'a Array,
    /// The medium.
    pub medium: Medium,
    /// Carrier frequency, Hz.
    pub frequency_hz: f64,
    /// Directivity of its elements.
    pub transducer: &'a dyn Transducer,
}

/// A display as the controller plays it.
#[derive(Debug, Clone, PartialEq)]
pub struct ComposedDisplay {
    /// The drive program.
    pub program: DriveProgram,
    /// The foci in each of its frames.
    pub slots: Vec<Slot>,
    /// Mean quality of the frames with several foci; `None` if there are none.
    pub quality: Option<Quality>,
    /// Achieved modulation frequency, Hz; `None` for a continuous wave.
    pub modulation_hz: Option<f64>,
    /// The frequency sweep of the modulation, if any.
    pub sweep: Option<Sweep>,
}

impl ComposedDisplay {
    /// The drives of the array, each once: the phases of each frame as the controller rounds them, at full envelope. Every element of a
    /// composed frame is driven fully.
    pub fn drives(&self, controller: &ArrayIdentity) -> Vec<Excitation> {
        let mut seen = HashSet::new();
        let frames = self.program.frames().iter();
        let phases_rad =
            |frame| phasors(frame, controller).iter().map(|drive| drive.arg()).collect();
        frames
            .map(phases_rad)
            .filter(|phases_rad: &Vec<f64>| {
                seen.insert(phases_rad.iter().map(|rad| rad.to_bits()).collect::<Vec<_>>())
            })
            .map(Excitation::Phases)
            .collect()
    }
}

/// Composes a display for an array behind a controller.
///
/// # Errors
/// [`DisplayError`] if the controller cannot play it.
pub fn compose(
    display: &DisplayFile,
    radiating: &RadiatingArray,
    controller: &ArrayIdentity,
) -> Result<ComposedDisplay, DisplayError> {
    let tracks = display.tracks();
    for (focus, track) in tracks.iter().enumerate() {
        if let Some(piece) = track.pieces().iter().find(|piece| piece.at_m.z <= 0.0) {
            return Err(DisplayError::BehindArray { focus, z_mm: piece.at_m.z * 1e3 });
        }
    }
    let carrier_hz = controller.carrier_hz();
    let slots = join(&tracks, display.schedule(), carrier_hz, controller.most_frames)?;
    let (frames, quality) = frames(display, radiating, controller, &slots)?;
    let envelope = match display.modulation {
        Some(modulation) => modulation.envelope(carrier_hz, controller.most_levels)?,
        None => Envelope::continuous(),
    };
    let program = DriveProgram::new(frames, envelope)?;
    program.fits(controller)?;
    let modulation_hz = match display.modulation {
        // The frequency of a movement is that of the loop in whole carrier periods.
        Some(modulation) if program.envelope().levels().len() == 1 => {
            let requested_hz = modulation.frequency_hz();
            let loop_s = program.loop_periods() as f64 / carrier_hz;
            Some((requested_hz * loop_s).round().max(1.0) / loop_s)
        }
        Some(modulation) => Some(modulation.achieved_hz(carrier_hz, controller.most_levels)?),
        None => None,
    };
    let most = controller.most_levels;
    let sweep =
        display.modulation.map(|modulation| modulation.sweep(carrier_hz, most)).transpose()?;
    Ok(ComposedDisplay { program, slots, quality, modulation_hz, sweep: sweep.flatten() })
}

/// The frame of each slot, and the mean quality of those with several foci.
fn frames(
    display: &DisplayFile,
    radiating: &RadiatingArray,
    controller: &ArrayIdentity,
    slots: &[Slot],
) -> Result<(Vec<DriveFrame>, Option<Quality>), DisplayError> {
    let places: Vec<Vec3> =
        slots.iter().flat_map(|slot| slot.foci.iter().map(|(_, at_m)| *at_m)).collect();
    let wavenumber_rad_m = radiating.medium.wavenumber_rad_m(radiating.frequency_hz);
    let transfer = Transfer::new(radiating.array, radiating.transducer, wavenumber_rad_m, &places);
    let rounds = display.rounds.get() as usize;
    let mut frames = Vec::with_capacity(slots.len());
    let mut qualities = Vec::new();
    let mut first = 0;
    for slot in slots {
        let rows: Vec<usize> = (first..first + slot.foci.len()).collect();
        first += slot.foci.len();
        let local = transfer.to_points(&rows);
        let levels: Vec<f64> =
            slot.foci.iter().map(|(focus, _)| display.focus[*focus].level.get()).collect();
        let phases_rad = local.solve(display.solver, &levels, rounds);
        let drives = phases_rad.into_iter().map(|phase_rad| (phase_rad, 1.0));
        let frame = DriveFrame::nearest(controller, drives, slot.periods)?;
        if levels.len() > 1 {
            qualities.push(local.quality(&phasors(&frame, controller), &levels));
        }
        frames.push(frame);
    }
    let mean = |read: fn(&Quality) -> f64| {
        qualities.iter().map(read).sum::<f64>() / qualities.len() as f64
    };
    let quality = (!qualities.is_empty()).then(|| Quality {
        uniformity: mean(|quality| quality.uniformity),
        efficiency: mean(|quality| quality.efficiency),
    });
    Ok((frames, quality))
}

/// The drive of each element in a frame at full envelope.
pub(super) fn phasors(frame: &DriveFrame, controller: &ArrayIdentity) -> Vec<Complex64> {
    let full = fieldgap_rig::focus_array::FULL_LEVEL;
    frame
        .fundamentals(full, controller.period_steps)
        .map(|fundamental| {
            fundamental.map_or(Complex64::ZERO, |fundamental| {
                let turns = fundamental.delay_steps / f64::from(controller.period_steps);
                Complex64::from_polar(fundamental.amplitude, std::f64::consts::TAU * turns)
            })
        })
        .collect()
}
