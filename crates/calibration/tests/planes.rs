//! Calibrations from planes of amplitudes, held against elements that are known. The readings come from the virtual rig's physics, vibrating
//! faces by their integrals; the fit is by the far field of pistons: they share no field code.

use std::path::Path;

use fieldgap_acoustics::{Array, Element, Excitation, Simulation, Vec3, delays_s};
use fieldgap_calibration::plane::{Group, PlaneCalibration, calibrate_planes};
use fieldgap_calibration::{CalibrationError, CodedReadings};
use fieldgap_comparison::{Mirror, Registering, register_scan};
use fieldgap_input::TomlSource;
use fieldgap_records::{ChannelState, RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_coded_readings};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SIDE: usize = 6;

/// Additive noise relative to the rms of the readings.
const NOISE: f64 = 0.02;

/// How widely the elements of a world are spread.
#[derive(Clone, Copy, Default)]
struct Spreads {
    gain: f64,
    phase_rad: f64,
    place_m: f64,
    tilt_rad: f64,
}

const ORDINARY: Spreads = Spreads { gain: 0.08, phase_rad: 0.15, place_m: 0.3e-3, tilt_rad: 0.035 };

/// A serpentine over a plane.
struct Plane {
    points: usize,
    step_m: f64,
    height_m: f64,
}

/// Coordinates of the robot's that run against the array's.
#[derive(Clone, Copy)]
struct Robot {
    mirrored_y: bool,
    shift_m: Vec3,
}

const STRAIGHT: Robot = Robot { mirrored_y: false, shift_m: Vec3::new(0.0, 0.0, 0.0) };

/// Elements driven alike, or focused beside the axis.
fn setup(is_focused: bool) -> ScanSetup {
    let focus =
        if is_focused { "x_mm = 8.0\ny_mm = 14.0\nz_mm = 80.0" } else { "phases = \"all-zero\"" };
    let text = format!(
        "format = 1\nname = \"plane\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
         layout = \"square\"\ncolumns = {SIDE}\nrows = {SIDE}\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\n\
         speed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\n{focus}\n"
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a setup")
}

fn simulation(setup: &ScanSetup) -> Simulation {
    Simulation {
        simulator: setup.simulator,
        array: setup.array.uncalibrated().clone(),
        medium: setup.medium.medium(),
        frequency_hz: setup.array.frequency_hz(),
        excitation: Excitation::Uniform,
    }
}

/// An array whose elements differ from what they are thought to be.
fn true_elements(setup: &ScanSetup, spreads: Spreads, seed: u64) -> Vec<Element> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = move || -> f64 { StandardNormal.sample(&mut random) };
    let of = |element: &Element| Element {
        amplitude: 1.0 + spreads.gain * draw(),
        phase_rad: spreads.phase_rad * draw(),
        centre_m: element.centre_m + Vec3::new(draw(), draw(), 0.0) * spreads.place_m,
        normal: Vec3::new(spreads.tilt_rad * draw(), spreads.tilt_rad * draw(), 1.0).normalize(),
        ..*element
    };
    setup.array.uncalibrated().elements().iter().map(of).collect()
}

fn scan(
    setup: &ScanSetup,
    elements: &[Element],
    plane: &Plane,
    effects: &str,
    robot: Robot,
    seed: u64,
) -> RecordedScan {
    let truth = Simulation {
        array: Array::from_elements(elements.to_vec()).expect("not empty"),
        ..simulation(setup)
    };
    let centre = 0.5 * (plane.points as f64 - 1.0);
    let places: Vec<Vec3> = (0..plane.points * plane.points)
        .map(|n| {
            let (column, row) = (n % plane.points, n / plane.points);
            let column = if row.is_multiple_of(2) { column } else { plane.points - 1 - column };
            let along = |n: usize| (n as f64 - centre) * plane.step_m;
            Vec3::new(along(column), along(row), plane.height_m)
        })
        .collect();
    let visits: Vec<(usize, Visit)> = places
        .iter()
        .enumerate()
        .map(|(n, &position_m)| {
            let way = if (n / plane.points).is_multiple_of(2) { 1.0 } else { -1.0 };
            let velocity_m_s = Vec3::new(0.05 * way, 0.0, 0.0);
            (0, Visit { position_m, velocity_m_s, time_s: 0.15 * n as f64 })
        })
        .collect();
    let effects: toml::Table = effects.parse().expect("TOML");
    let medium = setup.medium.medium();
    let excitation = setup.foci[0].excitation();
    let frequency_hz = setup.array.frequency_hz();
    let drives = [delays_s(&excitation, setup.array.array(), &medium, frequency_hz)];
    let levels = noise_free_coded_readings(&truth, &effects, 1.0, &drives, &visits, seed);
    let levels = levels.expect("valid effects");
    let rms = (levels.iter().map(|a| a * a).sum::<f64>() / levels.len() as f64).sqrt();
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let samples = places
        .iter()
        .zip(levels)
        .zip(&visits)
        .map(|((at, level), (_, visit))| {
            let normal: f64 = StandardNormal.sample(&mut random);
            let reading = (level + NOISE * rms * normal).abs();
            // What the robot calls this place.
            let mut called = at - robot.shift_m;
            if robot.mirrored_y {
                called.y = -called.y;
            }
            RecordedSample::measured(visit.time_s, Some(0), called, reading, None)
        })
        .collect();
    RecordedScan { setup: setup.clone(), samples }
}

fn calibrated(scan: &RecordedScan) -> PlaneCalibration {
    let registration = register_scan(scan, scan.setup.simulator, Registering::Auto);
    let readings = CodedReadings::of(scan);
    calibrate_planes(&simulation(&scan.setup), &readings, &registration.expect("comparable"))
        .expect("enough readings")
}

fn states(found: &PlaneCalibration, state: ChannelState) -> Vec<usize> {
    found.faults().filter(|(_, channel)| channel.state == state).map(|(n, _)| n).collect()
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

const NEAR: Plane = Plane { points: 48, step_m: 2e-3, height_m: 0.08 };

/// What was found of an array with a dead and a reversed element, beside the truth.
struct Outcome {
    /// Errors of gain and phase, and these in units of their standard errors.
    gain: Vec<f64>,
    phase_rad: Vec<f64>,
    gain_errors: Vec<f64>,
    phase_errors: Vec<f64>,
    found: PlaneCalibration,
}

const DEAD: usize = 8;
const REVERSED: usize = 21;

fn outcome(seed: u64) -> Outcome {
    let setup = setup(false);
    let elements = true_elements(&setup, ORDINARY, seed);
    let effects = format!(
        "[dead-elements]\nelements = [{DEAD}]\n[polarity]\nelements = [{REVERSED}]\n[backlash]\nmm = 0.4\n"
    );
    let found = calibrated(&scan(&setup, &elements, &NEAR, &effects, STRAIGHT, seed));
    let sound: Vec<usize> = (0..36).filter(|n| ![DEAD, REVERSED].contains(n)).collect();
    let mut amplitudes: Vec<f64> = sound.iter().map(|&n| elements[n].amplitude).collect();
    amplitudes.sort_by(f64::total_cmp);
    let median = 0.5 * (amplitudes[16] + amplitudes[17]);
    let mean = sound.iter().map(|&n| elements[n].phase_rad).sum::<f64>() / 34.0;
    let of = |off: &dyn Fn(usize) -> f64| sound.iter().map(|&n| off(n)).collect::<Vec<f64>>();
    let gain = |n: usize| found.channels[n].gain - elements[n].amplitude / median;
    let phase = |n: usize| found.channels[n].phase_rad - (elements[n].phase_rad - mean);
    Outcome {
        gain: of(&gain),
        phase_rad: of(&phase),
        gain_errors: of(&|n| gain(n) / found.channels[n].gain_error),
        phase_errors: of(&|n| phase(n) / found.channels[n].phase_error_rad),
        found,
    }
}

#[test]
fn gains_and_phases_are_found_within_their_errors_and_dead_and_reversed_elements_with_them() {
    let outcomes = [11, 12, 13].map(outcome);
    for Outcome { gain, phase_rad, found, .. } in &outcomes {
        // A dead element is told from a very weak one only if its gain is known well.
        let silent = found.channels[DEAD];
        assert!(matches!(silent.state, ChannelState::Dead | ChannelState::Weak), "{silent:?}");
        assert!(silent.gain < 0.15, "{silent:?}");
        assert_eq!(states(found, ChannelState::Reversed), [REVERSED]);
        assert_eq!(found.faults().count(), 2);

        let (gain, phase_rad) = (rms(gain), rms(phase_rad));
        assert!(gain < 0.5 * ORDINARY.gain, "{gain}");
        assert!(phase_rad < 0.5 * ORDINARY.phase_rad, "{phase_rad}");

        // A row scanned to the right lies by the play beside one scanned to the left.
        let backlash = found.shared("backlash_along_mm").expect("a serpentine");
        let off = backlash.value.abs() - 0.4;
        assert!(off.abs() < 4.0 * backlash.standard_error, "{backlash:?}");

        assert!(found.residual < 1.2 * NOISE, "{}", found.residual);
        let noise = found.noise[0].hypot(found.noise[1]);
        assert!((noise / NOISE - 1.0).abs() < 0.3, "{:?}", found.noise);
        let block = found.held_out.last().expect("48 points hold 4 x 4 blocks of 12");
        assert_eq!(block.points, 12);
        assert!(block.residual < 0.4 * block.before, "{block:?}");
        assert!(block.residual < 1.5 * block.expected, "{block:?}");
    }
    // In units of the standard errors: one, where these hold.
    let gain = rms(&outcomes.iter().flat_map(|o| o.gain_errors.clone()).collect::<Vec<_>>());
    let phase = rms(&outcomes.iter().flat_map(|o| o.phase_errors.clone()).collect::<Vec<_>>());
    assert!((0.7..1.6).contains(&gain) && (0.7..1.6).contains(&phase), "{gain} {phase}");
}

#[test]
#[ignore = "prints the figures of ten arrays: half a minute"]
fn ten_arrays() {
    let outcomes: Vec<Outcome> = (20..30).map(outcome).collect();
    let all = |of: fn(&Outcome) -> &Vec<f64>| {
        rms(&outcomes.iter().flat_map(|o| of(o).clone()).collect::<Vec<_>>())
    };
    let (gain, phase_rad) = (all(|o| &o.gain), all(|o| &o.phase_rad));
    println!("gain {gain:.4} ({:.2} errors)", all(|o| &o.gain_errors));
    println!("phase {:.3}° ({:.2} errors)", phase_rad.to_degrees(), all(|o| &o.phase_errors));
    for Outcome { found, .. } in &outcomes {
        let faults: Vec<_> = found.faults().map(|(n, channel)| (n, channel.state)).collect();
        let held: Vec<_> = found
            .held_out
            .iter()
            .map(|block| (block.points, block.before, block.residual, block.expected))
            .collect();
        println!("{faults:?} {held:.4?} noise {:.4}", found.map_noise.map_or(0.0, |n| n.relative));
    }
    assert!(gain < 0.5 * ORDINARY.gain && phase_rad < 0.5 * ORDINARY.phase_rad);
    assert!(outcomes.iter().all(|o| states(&o.found, ChannelState::Reversed) == [REVERSED]));
}

#[test]
fn an_array_that_is_as_it_is_thought_to_be_has_no_faults_and_no_spread() {
    let setup = setup(false);
    let elements = true_elements(&setup, Spreads::default(), 1);
    let found = calibrated(&scan(&setup, &elements, &NEAR, "", STRAIGHT, 2));
    assert_eq!(found.faults().count(), 0);
    for group in &found.groups {
        let most = match group.group {
            Group::Gain | Group::Phase => 0.02,
            Group::Place => 0.1,
            Group::Lean => 0.06,
        };
        assert!(group.spread < most, "{group:?}");
    }
    assert!(found.residual < 1.2 * NOISE, "{}", found.residual);
}

#[test]
fn a_mirrored_and_shifted_scan_is_calibrated_in_its_pose_and_checked_by_another() {
    let setup = setup(true);
    let elements = true_elements(&setup, ORDINARY, 5);
    let robot = Robot { mirrored_y: true, shift_m: Vec3::new(6e-3, 3e-3, 0.0) };
    let read = |seed| scan(&setup, &elements, &NEAR, "", robot, seed);
    let found = calibrated(&read(3));
    assert_eq!(found.mirror, Mirror::Y);
    for (name, truth) in [("shift_x_mm", 6.0), ("shift_y_mm", 3.0)] {
        let shift = found.shared(name).expect("a shift");
        let off = (shift.value - truth).abs();
        assert!(off < 4.0 * shift.standard_error + 0.05, "{shift:?}");
    }
    assert_eq!(found.faults().count(), 0);
    let gap = found.gap(&simulation(&setup), &CodedReadings::of(&read(4)));
    assert!(gap.after < 1.3 * NOISE && gap.before > 3.0 * gap.after, "{gap:?}");
}

#[test]
fn too_few_silent_and_foreign_readings_are_refused() {
    let setup = setup(false);
    let elements = true_elements(&setup, Spreads::default(), 1);
    let small = Plane { points: 14, ..NEAR };
    let read = scan(&setup, &elements, &small, "", STRAIGHT, 1);
    let registration = register_scan(&read, setup.simulator, Registering::GainOnly).expect("read");
    let readings = CodedReadings::of(&read);
    let simulation = simulation(&setup);
    let refused = |simulation: &Simulation, readings: &CodedReadings| {
        calibrate_planes(simulation, readings, &registration).expect_err("refused")
    };
    assert_eq!(
        refused(&simulation, &readings),
        CalibrationError::TooFew { readings: 196, elements: 36 }
    );
    let mut silent = CodedReadings::of(&scan(&setup, &elements, &NEAR, "", STRAIGHT, 1));
    silent.readings.iter_mut().for_each(|reading| reading.value = 0.0);
    assert_eq!(refused(&simulation, &silent), CalibrationError::Silent);
    let other = Array::square(5, 5, 10.5e-3).expect("not empty");
    let other = Simulation { array: other, ..simulation.clone() };
    assert_eq!(
        refused(&other, &readings),
        CalibrationError::OtherArray { channels: 36, elements: 25 }
    );
}
