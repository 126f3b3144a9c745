//! Registration by amplitude and phase, of fields that the virtual rig's vibrating pistons make: places off by a known pose, noise, and a clock that drifts.

use std::path::Path;

use fieldgap_acoustics::{Simulator, Vec3, delays_s};
use fieldgap_comparison::{
    Estimate, Mirror, Pose, Registering, Registration, register_scan, register_scan_by_amplitudes,
};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_coded_phasors};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Proportional noise, noise of each quadrature over the largest reading, and noise of a phase, radians.
const NOISE: (f64, f64, f64) = (0.01, 5e-3, 0.02);

const FOCUSED: &str = "[[focus]]\nx_mm = 8.0\ny_mm = -5.0\nz_mm = 100.0\n";
const IN_PHASE: &str = "[[focus]]\nphases = \"all-zero\"\n";
/// A scan in known coordinates.
struct Scan {
    simulator: Simulator,
    side: usize,
    drives: &'static str,
    heights_mm: &'static [f64],
    each_drive: bool,
    drift: fn(f64) -> f64,
}

impl Scan {
    /// Of one transducer, in one plane, row by row, with a clock that stands still.
    fn of_one() -> Self {
        Self {
            simulator: Simulator::Piston,
            side: 1,
            drives: IN_PHASE,
            heights_mm: &[150.0],
            each_drive: false,
            drift: |_| 0.0,
        }
    }

    fn setup(&self) -> ScanSetup {
        let reference = if self.each_drive { "each-drive" } else { "drive-sync" };
        let text = format!(
            "format = 1\nname = \"posed\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
             [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = {}\nrows = {}\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
             [medium]\nspeed_of_sound_m_s = 343.0\n\
             [phase]\nreference = \"{reference}\"\nconvention = \"exp(+iwt)\"\ndrift_u_rad = 0.1\n\
             [simulator]\nmodel = \"piston\"\n{}",
            self.side, self.side, self.drives
        );
        ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text.as_str())).expect("a set-up")
    }

    /// Places that lie at `pose`, read with noise.
    fn record(&self, pose: &Pose, seed: u64) -> RecordedScan {
        const SIDE: i32 = 13;
        const STEP_MM: f64 = 4.0;
        let setup = self.setup();
        let places_m: Vec<Vec3> = self
            .heights_mm
            .iter()
            .flat_map(|z_mm| (0..SIDE * SIDE).map(move |n| (n / SIDE, n % SIDE, *z_mm)))
            .map(|(row, column, z_mm)| {
                let column = if row % 2 == 1 { SIDE - 1 - column } else { column };
                let along = |n: i32| STEP_MM * f64::from(2 * n - SIDE + 1) / 2.0;
                Vec3::new(along(column), along(row), z_mm) * 1e-3
            })
            .collect();
        let simulation = setup.simulation(Simulator::Rayleigh, 0).expect("focus 0");
        let drives_s: Vec<Vec<f64>> = (0..setup.foci.len())
            .map(|focus| {
                let drive = setup.simulation(Simulator::Rayleigh, focus).expect("a focus");
                delays_s(&drive.excitation, &drive.array, &drive.medium, drive.frequency_hz)
            })
            .collect();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let count = places_m.len() * drives_s.len();
        let mut visits = Vec::new();
        for place_m in &places_m {
            for focus in 0..drives_s.len() {
                let (position_m, time_s) = (pose.to_array(place_m), visits.len() as f64);
                visits.push((focus, Visit { position_m, velocity_m_s: Vec3::zeros(), time_s }));
            }
        }
        let no_causes = toml::Table::new();
        let field =
            noise_free_coded_phasors(&simulation, &no_causes, 0.05, &drives_s, &visits, seed)
                .expect("no cause");
        let largest = field.iter().fold(0.0f64, |most, (level, _)| most.max(*level));
        let (proportional, additive, of_phase) = (NOISE.0, NOISE.1 * largest, NOISE.2);
        let samples =
            visits.iter().zip(field).enumerate().map(|(n, ((focus, visit), (level, rad)))| {
                let re = level * (1.0 + proportional * normal()) + additive * normal();
                let im: f64 = additive * normal();
                let of_clock =
                    2.3 + (self.drift)(n as f64 / (count - 1) as f64) + of_phase * normal();
                let of_drive = if self.each_drive { 1.9 * *focus as f64 } else { 0.0 };
                let phase_rad = -(rad + of_clock + of_drive + im.atan2(re));
                let place_m = places_m[n / drives_s.len()];
                RecordedSample::measured(visit.time_s, Some(*focus), place_m, re.hypot(im), None)
                    // One phase in a hundred was lost.
                    .with_phase((n % 100 != 57).then_some(phase_rad))
            });
        RecordedScan { samples: samples.collect(), setup }
    }
}

/// x, y and z: how far off, and the standard errors.
fn errors(found: &Registration, pose: &Pose) -> [[f64; 2]; 3] {
    let of = |axis: usize| {
        let Estimate { value, standard_error, .. } = found.shift_m[axis];
        [value - pose.shift_m[axis], standard_error]
    };
    [0, 1, 2].map(of)
}

/// Rms errors of x, y and z, m, and of the errors over their standard errors, over drawn poses: with phases and by amplitudes.
fn rms_errors(scan: &Scan, count: u64) -> [[[f64; 3]; 2]; 2] {
    let mut squares = [[[0.0; 3]; 2]; 2];
    for seed in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut within = |range: f64| range * (2.0 * random.random::<f64>() - 1.0);
        let pose = Pose {
            shift_m: Vec3::new(within(2e-3), within(2e-3), within(3e-3)),
            ..Pose::default()
        };
        let record = scan.record(&pose, seed);
        let found = [
            register_scan(&record, scan.simulator, Registering::Shift),
            register_scan_by_amplitudes(&record, scan.simulator, Registering::Shift),
        ];
        for (squares, found) in squares.iter_mut().zip(found) {
            let found = found.expect("comparable");
            assert_eq!(found.chosen, Registering::Shift, "{}", found.why);
            for (n, [error, standard]) in errors(&found, &pose).into_iter().enumerate() {
                squares[0][n] += error * error / count as f64;
                squares[1][n] += (error / standard).powi(2) / count as f64;
            }
        }
    }
    squares.map(|by| by.map(|of| of.map(f64::sqrt)))
}

/// The standard errors of the first axes are right, and the errors over those by amplitudes are below `most`.
fn assert_better<const AXES: usize>(scan: &Scan, count: u64, most: [f64; AXES]) {
    let [[with, over_errors], [without, _]] = rms_errors(scan, count);
    let shares = [0, 1, 2].map(|axis| with[axis] / without[axis]);
    let mm = |m: [f64; 3]| m.map(|m| m * 1e3);
    eprintln!("{:.4?} mm with phases, {:.4?} without: {shares:.2?}", mm(with), mm(without));
    for axis in 0..AXES {
        assert!(shares[axis] < most[axis], "{axis}: {shares:?}");
        // The rms of ten standard normal numbers is within this but once in a thousand times.
        let over = over_errors[axis];
        assert!((0.4..1.75).contains(&over), "{axis}: {over} standard errors");
    }
}

/// The field of one transducer is smooth: its amplitudes hardly tell where they were read. A drift along the rows imitates a shift along y, so that only two
/// planes tell it much better.
#[test]
fn a_smooth_field_is_registered_many_times_better_with_phases() {
    assert_better(&Scan::of_one(), 12, [0.2, 0.8, 0.6]);
    let heights_mm = &[80.0, 130.0];
    let two_planes = Scan { simulator: Simulator::Rayleigh, heights_mm, ..Scan::of_one() };
    assert_better(&two_planes, 10, [0.3, 0.45, 0.6]);
}

#[test]
fn a_reference_that_drifts_shifts_nothing() {
    for drift in [(|p| 0.15 * p) as fn(f64) -> f64, |p| 0.1 * (4.0 * p).sin()] {
        assert_better(&Scan { drift, ..Scan::of_one() }, 12, [0.2, 1.2, 0.6]);
    }
}

/// A field full of lobes is registered well by its amplitudes; phases add a little. (Its height is off by 0.2 mm either way, since a piston's far field
/// is not the near field of the truth.)
#[test]
fn a_focused_field_is_registered_better_with_phases() {
    let heights_mm = &[80.0, 130.0];
    let scan = Scan { side: 3, drives: FOCUSED, heights_mm, each_drive: true, ..Scan::of_one() };
    assert_better(&scan, 32, [1.0; 2]);
}

#[test]
fn a_mirrored_and_turned_scan_is_found_with_its_phases() {
    let pose = Pose {
        mirror: Mirror::X,
        turn_rad: 0.05,
        step_ratio: 0.98,
        shift_m: Vec3::new(6e-3, -9e-3, 4e-3),
    };
    let scan = Scan { side: 6, drives: FOCUSED, heights_mm: &[110.0], ..Scan::of_one() };
    let record = scan.record(&pose, 5);
    let found = register_scan(&record, Simulator::Piston, Registering::Pose).expect("comparable");
    assert_eq!(found.mirror, Mirror::X, "{}", found.why);
    assert!((found.turn_rad.value - 0.05).abs() < 6e-3, "{found:#?}");
    assert!((found.step_ratio.value - 0.98).abs() < 6e-3, "{found:#?}");
    assert!((found.pose().shift_m - pose.shift_m).xy().norm() < 0.1e-3, "{found:#?}");
    let phases = found.phases.expect("phases");
    assert_eq!(phases.known, 167);
    assert!((0.01..0.06).contains(&phases.noise_rad), "{phases:?}");
}

/// The record with its phases taken away has the same registration as the record by its amplitudes.
#[test]
fn phases_that_are_left_out_do_nothing() {
    let pose = Pose { shift_m: Vec3::new(1e-3, -2e-3, 3e-3), ..Pose::default() };
    let scan = Scan { side: 3, drives: FOCUSED, ..Scan::of_one() };
    let record = scan.record(&pose, 3);
    let mut plain = record.clone();
    plain.setup.phase = None;
    plain.samples.iter_mut().for_each(|sample| sample.phase_rad = None);
    let by = |of: fn(_, _, _) -> _, record| of(record, Simulator::Piston, Registering::Shift);
    let amplitudes = by(register_scan_by_amplitudes, &record).expect("comparable");
    assert_eq!(Ok(&amplitudes), by(register_scan, &plain).as_ref());
    assert_eq!(amplitudes.phases, None);
    assert_ne!(Ok(&amplitudes), by(register_scan, &record).as_ref());
}

/// A convention that is stated the wrong way round makes phases that agree nowhere. They then hardly count, and the reason says so.
#[test]
fn phases_of_the_wrong_convention_do_no_harm() {
    let pose = Pose { shift_m: Vec3::new(1e-3, -2e-3, 3e-3), ..Pose::default() };
    let scan = Scan { side: 3, drives: FOCUSED, ..Scan::of_one() };
    let mut record = scan.record(&pose, 3);
    record
        .samples
        .iter_mut()
        .for_each(|sample| sample.phase_rad = sample.phase_rad.map(|rad| -rad));
    let found = register_scan(&record, scan.simulator, Registering::Shift).expect("comparable");
    assert!(found.why.contains("convention"), "{}", found.why);
    for [error, standard] in errors(&found, &pose) {
        assert!(error.abs() < 4.0 * standard && standard < 1e-3, "{error} {standard}");
    }
}
