//! Time of a diagnosis against the number of readings and elements, and of one simulation of the same readings:
//! `cargo bench --bench diagnosis`.
//!
//! The scans are simulated with another speed of sound than the nominal one, with noise, dark readings and repeats. The time is that
//! from the readings to the verdict, on all threads. Each figure is the best of several runs.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use fieldgap::acoustics::{Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap::diagnosis::{EffectId, diagnose};
use fieldgap::input::TomlSource;
use fieldgap::records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap::virtual_rig::counter_rng::CounterRng;

const ROUNDS: usize = 3;

/// Number of dark readings before the scan, and the interval of repeated points.
const SILENT: usize = 64;
const AGAIN: usize = 20;

/// Standard deviations: in proportion to the level, and of each quadrature over the largest reading.
const SHARE: f64 = 0.02;
const ADDITIVE: f64 = 0.005;

fn main() {
    println!("readings  elements  simulation   diagnosis       ratio");
    for (side, step_mm) in [(6, 4.0), (6, 2.0), (6, 1.0), (3, 2.0), (12, 2.0)] {
        let scan = scan(side, step_mm);
        let driven: Vec<Vec3> = scan
            .samples
            .iter()
            .filter(|s| s.focus.is_some())
            .map(|s| s.position_mm * 1e-3)
            .collect();
        let nominal = nominal(&scan.setup);
        let (mut field_s, mut diagnosis_s) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let start = Instant::now();
            black_box(nominal.magnitudes(&driven));
            field_s = field_s.min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            let diagnosis = diagnose(std::slice::from_ref(&scan), None).expect("readings enough");
            diagnosis_s = diagnosis_s.min(start.elapsed().as_secs_f64());
            assert_eq!(diagnosis.effects, [EffectId::SoundSpeed], "{}", diagnosis.sentence);
        }
        println!(
            "{:8}  {:8}  {:7.2} ms  {:7.2} s  {:10.0}",
            driven.len(),
            side * side,
            1e3 * field_s,
            diagnosis_s,
            diagnosis_s / field_s
        );
    }
}

/// Four planes of 70 mm over a square array, with a higher speed of sound than nominal.
fn scan(side: usize, step_mm: f64) -> RecordedScan {
    let text = format!(
        "format = 1\nname = \"bench\"\nrecorded = 2026-01-01T00:00:00Z\nreading = \"V\"\n\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = {side}\nrows = {side}\n\
         element_diameter_mm = 10.5\nspacing_mm = 0.0\n\n[medium]\nspeed_of_sound_m_s = 343.0\n\n\
         [simulator]\nmodel = \"piston\"\n\n[[focus]]\nx_mm = 10.0\ny_mm = -15.0\nz_mm = 100.0\n"
    );
    let source = TomlSource::new(Path::new("bench.toml"), text);
    let setup = ScanSetup::parse(&source).expect("a good set-up");
    let mut places_mm: Vec<Vec3> = Vec::new();
    for z_mm in [60.0, 90.0, 120.0, 150.0] {
        let plane = PlaneGrid::square(35e-3, step_mm * 1e-3, z_mm * 1e-3);
        for place_m in plane.points() {
            places_mm.push(place_m * 1e3);
            if places_mm.len().is_multiple_of(AGAIN) {
                places_mm.push(place_m * 1e3);
            }
        }
    }
    let places_m: Vec<Vec3> = places_mm.iter().map(|place_mm| place_mm * 1e-3).collect();
    let faster = Medium { speed_of_sound_m_s: 346.0 };
    // (Delays are those for the nominal speed of sound.)
    let levels = driven_for(&setup, faster).magnitudes(&places_m);
    let largest = levels.iter().copied().fold(0.0, f64::max);
    let rng = CounterRng::new(1);
    let read = |n: usize, level: f64| {
        let normal = |part: u64| rng.normal(3 * n as u64 + part);
        let detected = (level / largest + ADDITIVE * normal(0)).hypot(ADDITIVE * normal(1));
        detected * (1.0 + SHARE * normal(2))
    };
    let mut samples = Vec::new();
    let mut sample = |focus, position_mm, level| {
        let (time_s, reading) = (0.1 * samples.len() as f64, read(samples.len(), level));
        samples.push(RecordedSample {
            time_s,
            focus,
            position_mm,
            reading,
            phase_rad: None,
            spread: None,
        });
    };
    for _ in 0..SILENT {
        sample(None, Vec3::new(0.0, 0.0, 150.0), 0.0);
    }
    for (place_mm, level) in places_mm.into_iter().zip(levels) {
        sample(Some(0), place_mm, level);
    }
    RecordedScan { setup, samples }
}

fn nominal(setup: &ScanSetup) -> Simulation {
    setup.simulation(Simulator::Piston, 0).expect("a focus")
}

/// The set-up in another medium, with the phases of its own.
fn driven_for(setup: &ScanSetup, medium: Medium) -> Simulation {
    let nominal = nominal(setup);
    let phases_rad =
        nominal.excitation.phases_rad(&nominal.array, &nominal.medium, nominal.frequency_hz);
    Simulation { medium, excitation: Excitation::Phases(phases_rad), ..nominal }
}
