//! Scans made by hand of 6 x 6 vibrating pistons, the Rayleigh integral over each face: no simulator has a part in them.

use std::path::Path;

use fieldgap::acoustics::rayleigh::{DiscRule, Piston};
use fieldgap::acoustics::{PlaneGrid, Simulator, Vec3};
use fieldgap::input::TomlSource;
use fieldgap::records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap::virtual_rig::counter_rng::CounterRng;
use num_complex::Complex64;

const SETUP: &str = r#"
format = 1
name = "planes"
recorded = 2026-01-01T00:00:00Z
reading = "V"

[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0

[medium]
speed_of_sound_m_s = 343.0

[simulator]
model = "piston"

[[focus]]
x_mm = 17.5
y_mm = -22.5
z_mm = 100.0
"#;

/// Speed of the robot, along rows and between planes alike.
const SPEED_MM_S: f64 = 20.0;

/// Standard deviations of the noise: in proportion to the level, and of each quadrature over the peak.
pub const SHARE: f64 = 0.02;
pub const ADDITIVE: f64 = 0.005;

/// Silent readings before the scan, and every how many places one is visited again at its end.
const SILENT: usize = 64;
const AGAIN: usize = 20;

/// What is true and not believed.
pub struct Truth {
    /// Amplitude of each element.
    pub gain: fn(usize) -> f64,
    /// Phase of each element, rad.
    pub turned_rad: fn(usize) -> f64,
    /// What the driver makes of a phase, rad.
    pub driven: fn(f64) -> f64,
    /// Where the robot is that says it is at a place, mm, given the number of the reading.
    pub stands_mm: fn(usize, &Vec3) -> Vec3,
    /// A small thing in the field: where it hangs, mm, and what it radiates at 1 mm over what reaches it.
    pub scatterer: Option<(Vec3, f64)>,
    /// Sound beside the array's, as a factor of the level at a place, mm.
    pub beside: fn(&Vec3) -> f64,
    /// What the receiver makes of a reading over the peak, given how far through the scan it is, 0 to 1.
    pub received: fn(f64, f64) -> f64,
}

impl Default for Truth {
    fn default() -> Self {
        Self {
            gain: |_| 1.0,
            turned_rad: |_| 0.0,
            driven: |phase_rad| phase_rad,
            stands_mm: |_, at_mm| *at_mm,
            scatterer: None,
            beside: |_| 1.0,
            received: |reading, _| reading,
        }
    }
}

/// Planes of 71 mm by serpentine, with silence before, places visited again at the end, and noise on every reading.
pub fn scan(heights_mm: &[f64], truth: &Truth) -> RecordedScan {
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP));
    let setup = setup.expect("a good set-up");
    let mut places_mm: Vec<Vec3> = Vec::new();
    for z_mm in heights_mm {
        let mut points = PlaneGrid::square(35e-3, 2e-3, z_mm * 1e-3).points();
        for (number, row) in points.chunks_mut(36).enumerate() {
            if number % 2 == 1 {
                row.reverse();
            }
        }
        places_mm.extend(points.into_iter().map(|point_m| point_m * 1e3));
    }
    let again: Vec<Vec3> = places_mm.iter().step_by(AGAIN).copied().collect();
    places_mm.extend(again);
    let levels = levels(&setup, &places_mm, truth);
    let largest = levels.iter().copied().fold(0.0, f64::max);
    let rng = CounterRng::new(1);
    let noise = |n: usize, part: u64| rng.normal(3 * n as u64 + part);
    let read = |n: usize, level: f64| {
        let heard = (level / largest + ADDITIVE * noise(n, 0)).hypot(ADDITIVE * noise(n, 1));
        heard * (1.0 + SHARE * noise(n, 2))
    };
    let silent = (0..SILENT).map(|n| (None, places_mm[0], read(n + places_mm.len(), 0.0)));
    let driven = places_mm.iter().zip(levels).enumerate().map(|(n, (place_mm, level))| {
        let progress = n as f64 / places_mm.len() as f64;
        (Some(0), *place_mm, (truth.received)(read(n, level), progress))
    });
    let (mut time_s, mut before_mm) = (0.0, places_mm[0]);
    let samples = silent
        .chain(driven)
        .map(|(focus, position_mm, reading)| {
            time_s += ((position_mm - before_mm).norm() / SPEED_MM_S).max(0.01);
            before_mm = position_mm;
            RecordedSample { time_s, focus, position_mm, reading, phase_rad: None, spread: None }
        })
        .collect();
    RecordedScan { setup, samples }
}

/// Magnitude of the field of the true array at each place.
fn levels(setup: &ScanSetup, places_mm: &[Vec3], truth: &Truth) -> Vec<f64> {
    let believed = setup.simulation(Simulator::Piston, 0).expect("one focus");
    let wavenumber_rad_m = believed.medium.wavenumber_rad_m(believed.frequency_hz);
    let phases_rad =
        believed.excitation.phases_rad(&believed.array, &believed.medium, believed.frequency_hz);
    let elements = believed.array.elements();
    let ka = wavenumber_rad_m * elements[0].radius_m;
    let rule = DiscRule::for_piston(ka, 2.0, 1e-3);
    let pistons: Vec<Piston> = elements
        .iter()
        .map(|element| Piston::new(element.centre_m, element.normal, element.radius_m, &rule))
        .collect();
    let weights: Vec<Complex64> = phases_rad
        .iter()
        .enumerate()
        .map(|(n, phase_rad)| {
            let phase_rad = (truth.driven)(*phase_rad) + (truth.turned_rad)(n);
            Complex64::from_polar((truth.gain)(n), phase_rad)
        })
        .collect();
    let field = |at_mm: &Vec3| -> Complex64 {
        let parts = pistons.iter().zip(&weights);
        parts.map(|(p, w)| w * p.field(at_mm * 1e-3, wavenumber_rad_m)).sum()
    };
    let scattered = truth.scatterer.map(|(from_mm, strength_mm)| {
        let reaches_it = field(&from_mm);
        move |at_mm: &Vec3| {
            let distance_mm = (at_mm - from_mm).norm();
            let phase_rad = wavenumber_rad_m * 1e-3 * distance_mm;
            reaches_it * Complex64::from_polar(strength_mm / distance_mm, phase_rad)
        }
    });
    places_mm
        .iter()
        .enumerate()
        .map(|(number, place_mm)| {
            let at_mm = (truth.stands_mm)(number, place_mm);
            let scattered = scattered.as_ref().map_or(Complex64::ZERO, |wave| wave(&at_mm));
            (field(&at_mm) + scattered).norm() * (truth.beside)(place_mm)
        })
        .collect()
}
