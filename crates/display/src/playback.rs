//! The field of a display, computed from the drive program as sent.

use super::compose::{RadiatingArray, phasors};
use fieldgap_acoustics::{Array, Element, FieldKernel, PathLengths, Vec3};
use fieldgap_level::of_level_pa;
use fieldgap_rig::focus_array::{ArrayIdentity, Channel, DriveProgram, FULL_LEVEL};

/// Distance at which the level of an element is specified, m.
const SPECIFIED_AT_M: f64 = 0.3;

/// A drive program on an array: the sound pressure at any position and time.
pub struct Playback<'a> {
    program: &'a DriveProgram,
    radiating: RadiatingArray<'a>,
    controller: &'a ArrayIdentity,
    /// Pa rms per unit of the simulator.
    gain_pa: f64,
}

impl<'a> Playback<'a> {
    /// For an array whose nominal element has the level `element_db`, dB re 20 µPa rms, on its axis at 300 mm.
    pub fn new(
        program: &'a DriveProgram,
        radiating: RadiatingArray<'a>,
        controller: &'a ArrayIdentity,
        element_db: f64,
    ) -> Self {
        let single = Array::from_elements(vec![Element::at(0.0, 0.0)]).expect("one element");
        let wavenumber_rad_m = radiating.medium.wavenumber_rad_m(radiating.frequency_hz);
        let kernel = FieldKernel::new(
            &single,
            &[0.0],
            radiating.transducer,
            wavenumber_rad_m,
            PathLengths::Observed,
        );
        let unit = kernel.at(&[Vec3::z() * SPECIFIED_AT_M])[0].norm();
        Self { program, radiating, controller, gain_pa: of_level_pa(element_db) / unit }
    }

    /// The program.
    pub fn program(&self) -> &DriveProgram {
        self.program
    }

    /// Sound pressures of a frame at full envelope, Pa rms.
    pub fn rms_pa(&self, frame: usize, points_m: &[Vec3]) -> Vec<f64> {
        let drives = phasors(&self.program.frames()[frame], self.controller);
        let driven = self
            .radiating
            .array
            .elements()
            .iter()
            .zip(&drives)
            .map(|(element, drive)| Element {
                amplitude: element.amplitude * drive.norm(),
                ..*element
            })
            .collect();
        let array = Array::from_elements(driven).expect("as many as before");
        let phases_rad: Vec<f64> = drives.iter().map(|drive| drive.arg()).collect();
        let wavenumber_rad_m = self.radiating.medium.wavenumber_rad_m(self.radiating.frequency_hz);
        FieldKernel::new(
            &array,
            &phases_rad,
            self.radiating.transducer,
            wavenumber_rad_m,
            PathLengths::Observed,
        )
        .at(points_m)
        .into_iter()
        .map(|pressure| pressure.norm() * self.gain_pa)
        .collect()
    }

    /// Relative amplitude of a full channel under the envelope in a carrier period, 0 to 1.
    pub fn envelope_at(&self, period: u64) -> f64 {
        let level = self.program.envelope().level_at(period);
        let steps = self.controller.period_steps;
        Channel { delay_steps: 0, level: FULL_LEVEL }
            .pulse(level, steps)
            .map_or(0.0, |pulse| pulse.fundamental(steps).amplitude)
    }

    /// Sound pressure at a position in each carrier period from the start, Pa rms.
    pub fn pressure_over_time_pa(&self, at_m: Vec3, periods: u64) -> Vec<f64> {
        let frames: Vec<f64> =
            (0..self.program.frames().len()).map(|frame| self.rms_pa(frame, &[at_m])[0]).collect();
        (0..periods)
            .map(|period| frames[self.program.frame_at(period)] * self.envelope_at(period))
            .collect()
    }
}
