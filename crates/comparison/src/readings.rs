//! The readings of a registration and the simulated field at their positions.

use std::collections::HashSet;

use fieldgap_acoustics::golden_section::even_fraction;
use fieldgap_acoustics::{Array, Simulation, Simulator, Vec3};
use fieldgap_records::{PhaseReference, RecordedSample, RecordedScan};
use num_complex::Complex64;

use super::averaging::has_phases;
use super::pose::Pose;

/// Step of the difference quotient of the simulated field, metres: a ten-thousandth of a radian of phase at 40 kHz,
/// far above rounding and far below the field's own structure.
const DIFFERENCE_M: f64 = 2e-7;

/// The readings taken with the array driven, drive by drive, in the order of acquisition.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    drives: Vec<Drive>,
    reference: Option<Reference>,
}

/// What is known of the reference of the phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Whether it starts anew with each drive.
    pub each_drive: bool,
    /// Standard uncertainty of its drift from the first reading to the last, radians.
    pub drift_u_rad: f64,
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
    /// Their phases, where they are used.
    pub phases: Vec<Phase>,
}

/// The phase of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phase {
    /// In the convention exp(-iωt), radians; `None` where it was lost.
    pub rad: Option<f64>,
    /// When it was read: 0 at the first driven reading of the scan, 1 at the last.
    pub progress: f64,
}

impl Drive {
    /// Only the readings of these indices.
    pub fn only(&self, indices: &[usize]) -> Self {
        Self {
            positions_m: indices.iter().map(|&index| self.positions_m[index]).collect(),
            readings: indices.iter().map(|&index| self.readings[index]).collect(),
            phases: indices.iter().filter_map(|&index| self.phases.get(index).copied()).collect(),
            ..self.clone()
        }
    }
}

/// The simulated field at each reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// Magnitudes, in the simulator's unit.
    pub magnitudes: Vec<f64>,
    /// Phases as unit phasors; empty where they are not used.
    pub turns: Vec<Complex64>,
}

/// The change of the simulated field at each reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// Of the magnitudes, in the simulator's unit.
    pub magnitudes: Vec<f64>,
    /// Of the phases, radians; empty where they are not used.
    pub phases: Vec<f64>,
}

/// The simulated field at each reading and its gradient.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedGradient {
    /// The field.
    pub at: Simulated,
    /// Its change per metre along x, y and z of the array.
    pub per_m: [Slope; 3],
}

impl Readings {
    /// The driven readings of a scan, to be simulated by `simulator`; with the phases of a scan that has them, if they are to be used.
    pub fn of(scan: &RecordedScan, simulator: Simulator, use_phases: bool) -> Self {
        let section = scan.setup.phase.filter(|_| use_phases && has_phases(scan));
        let driven = || scan.samples.iter().filter(|sample| sample.focus.is_some());
        let times_s = || driven().map(|sample| sample.time_s);
        let first_s = times_s().fold(f64::INFINITY, f64::min);
        let lasts_s = times_s().fold(f64::NEG_INFINITY, f64::max) - first_s;
        let phase = |sample: &RecordedSample| {
            section.map(|section| Phase {
                rad: sample.phase_rad.map(|rad| section.convention.turned(rad)),
                progress: (sample.time_s - first_s) / lasts_s.max(f64::MIN_POSITIVE),
            })
        };
        let drives = (0..scan.setup.foci.len())
            .filter_map(|focus| {
                let samples: Vec<&RecordedSample> =
                    scan.samples.iter().filter(|sample| sample.focus == Some(focus)).collect();
                let simulation = scan.setup.simulation(simulator, focus)?;
                (!samples.is_empty()).then(|| Drive {
                    focus,
                    simulation,
                    positions_m: samples.iter().map(|sample| sample.position_m()).collect(),
                    readings: samples.iter().map(|sample| sample.reading).collect(),
                    phases: samples.iter().filter_map(|sample| phase(sample)).collect(),
                })
            })
            .collect();
        let reference = section.map(|section| Reference {
            each_drive: section.reference == PhaseReference::EachDrive,
            drift_u_rad: section.drift_u_rad(),
        });
        Self { drives, reference }
    }

    /// Takes drives as they are, without phases.
    #[cfg(test)]
    pub fn from_drives(drives: Vec<Drive>) -> Self {
        Self { drives, reference: None }
    }

    /// The same scan with other drives.
    pub fn with_drives(&self, drives: Vec<Drive>) -> Self {
        Self { drives, ..*self }
    }

    /// What is known of the reference of the phases; `None` where phases are not used.
    pub fn reference(&self) -> Option<Reference> {
        self.reference
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
                drive.only(&kept)
            })
            .filter(|drive| !drive.readings.is_empty())
            .collect();
        self.with_drives(drives)
    }

    /// The simulated field at each reading, if the scan lies at `pose`.
    pub fn simulate(&self, pose: &Pose) -> Simulated {
        self.field(|scan_m| pose.to_array(scan_m))
    }

    /// The same with its gradient.
    pub fn simulate_gradient(&self, pose: &Pose) -> SimulatedGradient {
        let at = self.simulate(pose);
        let per_m = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
            let beside = self.field(|scan_m| pose.to_array(scan_m) + axis * DIFFERENCE_M);
            at.slope_to(&beside, DIFFERENCE_M)
        });
        SimulatedGradient { at, per_m }
    }

    /// Change of the simulated field per relative change of the array's pitch, its drive being kept.
    pub fn simulate_pitch(&self, pose: &Pose) -> Slope {
        /// Relative, as small for a field a few hundred wavelengths wide as the step above.
        const STRETCH: f64 = 1e-6;
        let stretched = self.drives.iter().map(|drive| Drive {
            simulation: stretched(&drive.simulation, 1.0 + STRETCH),
            ..drive.clone()
        });
        let stretched = self.with_drives(stretched.collect());
        self.simulate(pose).slope_to(&stretched.simulate(pose), STRETCH)
    }

    fn field(&self, to_array: impl Fn(&Vec3) -> Vec3) -> Simulated {
        let mut simulated = Simulated { magnitudes: Vec::new(), turns: Vec::new() };
        for drive in &self.drives {
            let points_m: Vec<Vec3> = drive.positions_m.iter().map(&to_array).collect();
            if self.reference.is_none() {
                simulated.magnitudes.extend(drive.simulation.magnitudes(&points_m));
                continue;
            }
            let (field, rms) = (drive.simulation.field(&points_m), drive.simulation.rms());
            simulated.magnitudes.extend(field.iter().map(|pressure| rms(*pressure)));
            let turn = |pressure: &Complex64| pressure / pressure.norm().max(f64::MIN_POSITIVE);
            simulated.turns.extend(field.iter().map(turn));
        }
        simulated
    }
}

impl Simulated {
    /// The change to a field beside, per unit of the step.
    fn slope_to(&self, beside: &Self, step: f64) -> Slope {
        let magnitudes = self.magnitudes.iter().zip(&beside.magnitudes);
        let turns = self.turns.iter().zip(&beside.turns);
        Slope {
            magnitudes: magnitudes.map(|(at, beside)| (beside - at) / step).collect(),
            phases: turns.map(|(at, beside)| (beside * at.conj()).arg() / step).collect(),
        }
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
