//! The emulator of the AUTD3 project, which has only monopoles, for the same plane in the same run.

use std::time::Duration;

use autd3::core::geometry::{Device, Transducer};
use autd3::gain::Custom;
use autd3::prelude::{Drive, Intensity, Phase, Point3, Silencer, UnitQuaternion, rad};
use autd3_emulator::{Emulator, RangeXY, Record, RecorderControllerExt as _, Rms, RmsRecordOption};
use fieldgap::acoustics::PlaneGrid;

use crate::{Case, ROUNDS};

/// One period of 40 kHz, the shortest emulated time.
const PERIOD: Duration = Duration::from_micros(25);

/// Periods in a record: one for each round, and one for the comparison.
const PERIODS: u32 = ROUNDS as u32 + 1;

/// A recorded drive of an array and the observed plane.
pub struct Recorded {
    record: Record,
    plane: RangeXY,
    speed_of_sound_mm_s: f32,
}

impl Recorded {
    /// The case's array, each element driven at full strength, its phase rounded to 256 steps as that project's boards do.
    pub fn new(case: &Case, plane: &PlaneGrid) -> Self {
        let places = case.array.elements().iter().map(|element| {
            let [x, y, z] = [0, 1, 2].map(|axis| (1e3 * element.centre_m[axis]) as f32);
            Transducer::new(Point3::new(x, y, z))
        });
        let emulator = Emulator::new([Device::new(UnitQuaternion::identity(), places.collect())]);
        let drive = |phase_rad: f64| Drive {
            phase: Phase::from(phase_rad as f32 * rad),
            intensity: Intensity::MAX,
        };
        let record = emulator.record(|controller| {
            controller.send(Silencer::disable())?;
            controller.send(Custom::new(|_| {
                |element: &Transducer| drive(case.phases_rad[element.idx()])
            }))?;
            controller.tick(PERIODS * PERIOD)?;
            Ok(())
        });
        let points_m = plane.points();
        let (first, last) = (points_m[0] * 1e3, points_m[points_m.len() - 1] * 1e3);
        Self {
            record: record.expect("a drive that the emulator takes"),
            plane: RangeXY {
                x: first.x as f32..=last.x as f32,
                y: first.y as f32..=last.y as f32,
                z: first.z as f32,
                resolution: (1e3 * (points_m[1] - points_m[0]).norm()) as f32,
            },
            speed_of_sound_mm_s: (1e3 * std::f64::consts::TAU * 40e3 / case.wavenumber_rad_m)
                as f32,
        }
    }

    /// The plane with the distances from all elements, which the emulator reuses for all periods.
    pub fn prepared(&self) -> Rms {
        let option = RmsRecordOption { sound_speed: self.speed_of_sound_mm_s };
        self.record.sound_field(self.plane.clone(), option).expect("a plane")
    }
}

/// The level at each point in the next period.
pub fn levels(field: &mut Rms) -> Vec<f32> {
    let mut levels = vec![0.0; field.next_points_len()];
    let mut time_ns = [0];
    field
        .next_inplace(PERIOD, false, &mut time_ns, std::iter::once(levels.as_mut_ptr()))
        .expect("a period that was recorded");
    levels
}
