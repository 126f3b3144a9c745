//! The readings of a registration and the simulated field at their positions.

use std::collections::HashSet;

use fieldgap_acoustics::golden_section::even_fraction;
use fieldgap_acoustics::{Array, Simulation, Simulator, Vec3};
use fieldgap_records::RecordedScan;

use super::pose::Pose;

/// Step of the difference quotient of the simulated field, metres: a ten-thousandth of a radian of phase at 40 kHz,
/// far above rounding and far below the field's own structure.
const DIFFERENCE_M: f64 = 2e-7;

/// The readings taken with the array driven, drive by drive, in the order of acquisition.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    drives: Vec<Drive>,
}

/// Places closer than this are one, m.
const SAME_PLACE_M: f64 = 1e-5;

/// How many different places there are.
pub(super) fn places(positions_m: &[Vec3]) -> usize {
    let place = |at: &Vec3| [at.x, at.y, at.z].map(|m| (m / SAME_PLACE_M).round() as i64);
    positions_m.iter().map(place).collect::<HashSet<_>>().len()
}

/// The readings of one drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Its number in the record.
    pub focus: usize,
    /// The set-up that is simulated.
    pub simulation: Simulation,
    /// Positions reported by the robot, metres.
    pub positions_m: Vec<Vec3>,
    /// Readings, in the record's unit.
    pub readings: Vec<f64>,
}

/// The simulated field at each reading and its gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedGradient {
    /// Magnitudes, in the simulator's unit.
    pub magnitudes: Vec<f64>,
    /// Their change per metre along x, y and z of the array.
    pub per_m: [Vec<f64>; 3],
}

impl Readings {
    /// The driven readings of a scan, to be simulated by `simulator`.
    pub fn of(scan: &RecordedScan, simulator: Simulator) -> Self {
        let drives = (0..scan.setup.foci.len())
            .filter_map(|focus| {
                let samples = scan.samples.iter().filter(|sample| sample.focus == Some(focus));
                let (positions_m, readings): (Vec<Vec3>, Vec<f64>) =
                    samples.map(|sample| (sample.position_m(), sample.reading)).unzip();
                let simulation = scan.setup.simulation(simulator, focus)?;
                (!readings.is_empty()).then_some(Drive { focus, simulation, positions_m, readings })
            })
            .collect();
        Self { drives }
    }

    /// Takes drives as they are.
    pub fn from_drives(drives: Vec<Drive>) -> Self {
        Self { drives }
    }

    /// The drives.
    pub fn drives(&self) -> &[Drive] {
        &self.drives
    }

    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.drives.iter().map(|drive| drive.readings.len()).sum()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many different pairs of drive and place there are.
    pub fn different(&self) -> usize {
        self.drives.iter().map(|drive| places(&drive.positions_m)).sum()
    }

    /// Every reading, drive by drive.
    pub fn values(&self) -> Vec<f64> {
        self.drives.iter().flat_map(|drive| drive.readings.iter().copied()).collect()
    }

    /// Positions reported by the robot, metres.
    pub fn positions_m(&self) -> Vec<Vec3> {
        self.drives.iter().flat_map(|drive| drive.positions_m.iter().copied()).collect()
    }

    /// Shortest wavelength among the drives, metres; of a scan without readings, infinite.
    pub fn wavelength_m(&self) -> f64 {
        self.drives
            .iter()
            .map(|drive| drive.simulation.medium.wavelength_m(drive.simulation.frequency_hz))
            .fold(f64::INFINITY, f64::min)
    }

    /// About `count` of them, spread evenly over each drive, always the same ones.
    pub fn thinned(&self, count: usize) -> Self {
        let share = count as f64 / self.len().max(1) as f64;
        if share >= 1.0 {
            return self.clone();
        }
        let drives = self
            .drives
            .iter()
            .map(|drive| {
                let kept: Vec<usize> = (0..drive.readings.len())
                    .filter(|&index| even_fraction(index) < share)
                    .collect();
                Drive {
                    positions_m: kept.iter().map(|&index| drive.positions_m[index]).collect(),
                    readings: kept.iter().map(|&index| drive.readings[index]).collect(),
                    ..drive.clone()
                }
            })
            .filter(|drive| !drive.readings.is_empty())
            .collect();
        Self { drives }
    }

    /// The simulated magnitude at each reading, if the scan lies at `pose`.
    pub fn simulate(&self, pose: &Pose) -> Vec<f64> {
        self.magnitudes(|scan_m| pose.to_array(scan_m))
    }

    /// The same with its gradient.
    pub fn simulate_gradient(&self, pose: &Pose) -> SimulatedGradient {
        let magnitudes = self.simulate(pose);
        let per_m = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
            let beside = self.magnitudes(|scan_m| pose.to_array(scan_m) + axis * DIFFERENCE_M);
            difference_quotient(&magnitudes, &beside, DIFFERENCE_M)
        });
        SimulatedGradient { magnitudes, per_m }
    }

    /// Change of the simulated magnitudes per relative change of the array's pitch, its drive being kept.
    pub fn simulate_pitch(&self, pose: &Pose) -> Vec<f64> {
        /// Relative, as small for a field a few hundred wavelengths wide as the step above.
        const STRETCH: f64 = 1e-6;
        let stretched = Self {
            drives: self
                .drives
                .iter()
                .map(|drive| Drive {
                    simulation: stretched(&drive.simulation, 1.0 + STRETCH),
                    ..drive.clone()
                })
                .collect(),
        };
        difference_quotient(&self.simulate(pose), &stretched.simulate(pose), STRETCH)
    }

    fn magnitudes(&self, to_array: impl Fn(&Vec3) -> Vec3) -> Vec<f64> {
        self.drives
            .iter()
            .flat_map(|drive| {
                let points_m: Vec<Vec3> = drive.positions_m.iter().map(&to_array).collect();
                drive.simulation.magnitudes(&points_m)
            })
            .collect()
    }
}

/// A set-up with a larger pitch of the array and the same phases of the drives.
fn stretched(simulation: &Simulation, ratio: f64) -> Simulation {
    let phases_of = |array: &Array| {
        simulation.excitation.phases_rad(array, &simulation.medium, simulation.frequency_hz)
    };
    let mut elements = simulation.array.elements().to_vec();
    for element in &mut elements {
        element.centre_m.x *= ratio;
        element.centre_m.y *= ratio;
    }
    let mut array = Array::from_elements(elements.clone()).expect("as many elements as before");
    // For a focus the phases would follow the new positions of the elements: this change is undone.
    let original = phases_of(&simulation.array);
    let changed = phases_of(&array);
    for ((element, original), changed) in elements.iter_mut().zip(original).zip(changed) {
        element.phase_rad += original - changed;
    }
    array = Array::from_elements(elements).expect("as many elements as before");
    Simulation { array, ..simulation.clone() }
}

fn difference_quotient(at: &[f64], beside: &[f64], step: f64) -> Vec<f64> {
    at.iter().zip(beside).map(|(at, beside)| (beside - at) / step).collect()
}
