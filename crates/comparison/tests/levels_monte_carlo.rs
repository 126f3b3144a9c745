//! The budget of a measured level against the propagation of distributions (JCGM 101:2008).
//!
//! Every draw is a laboratory whose receiver, amplifier, face, tilt, place, air and noise differ from what its files state. The reading is
//! summed here, wave by wave, without the kernel. The level that the files make of the reading, less the true level at the stated
//! place in the stated air, is the error. The budget is not asked until its standard deviation is known.

use std::f64::consts::TAU;
use std::path::Path;

use fieldgap_acoustics::{Air, Simulator, Vec3};
use fieldgap_comparison::{Registering, compare};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const DRAWS: usize = 20_000;
const FOCUS: [f64; 3] = [0.004, -0.006, 0.08];
const SENSITIVITY_V_PA: f64 = 0.003;
const FACE_M: f64 = 2.5e-3;

/// Standard uncertainties: sensitivity, amplifier (dB), face (m), tilt (rad), place (m), temperature (°C), humidity (%).
const U: [f64; 7] = [0.03, 0.15, 0.3e-3, 0.05, 0.8e-3, 2.0, 10.0];

fn setup() -> ScanSetup {
    let [sensitivity, amplifier, face, tilt, place, temperature, humidity] = U;
    let [x, y, z] = FOCUS.map(|m| m * 1e3);
    let text = format!(
        "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
         [medium]\ntemperature_c = 20.0\nhumidity_percent = 50.0\n\
         [receiver]\nsensitivity_v_pa = {SENSITIVITY_V_PA}\nsensitivity_u_percent = {}\nreads = \"rms\"\n\
         amplifier_gain_db = 20.0\namplifier_u_db = {amplifier}\nface_radius_mm = {}\nface_radius_u_mm = {}\ntilt_u_deg = {}\n\
         place_u_mm = {}\ntemperature_u_c = {temperature}\nhumidity_u_percent = {humidity}\n\
         [simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\n",
        sensitivity * 100.0,
        FACE_M * 1e3,
        face * 1e3,
        tilt.to_degrees(),
        place * 1e3,
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good")
}

/// What differs from the files, in standard uncertainties; all zero: nothing.
#[derive(Clone, Copy, Default)]
struct Deviation {
    of: [f64; 7],
    about_x: f64,
    place: [f64; 3],
}

/// The reading, V, of a laboratory at a place; elements of 4 Pa rms at 1 m, summed as spherical waves of pistons.
fn reading(elements: &[Vec3], at: Vec3, deviation: Deviation, faced: bool) -> f64 {
    let [sensitivity, amplifier, face, about_y, _, warm, wet] = deviation.of;
    let speed = |t: f64, h: f64| {
        Air { temperature_c: t, humidity_percent: h, pressure_kpa: 101.325 }
            .medium()
            .speed_of_sound_m_s
    };
    let (temperature, humidity) = (20.0 + U[5] * warm, 50.0 + U[6] * wet);
    let air = Air { temperature_c: temperature, humidity_percent: humidity, pressure_kpa: 101.325 };
    let (k, k_stated) = (TAU * 40e3 / speed(temperature, humidity), TAU * 40e3 / speed(20.0, 50.0));
    let at = at + Vec3::from(deviation.place) * U[4];
    let (y, x) = (U[3] * about_y, U[3] * deviation.about_x);
    let axis = Vec3::new(y.sin() * x.cos(), x.sin(), y.cos() * x.cos());
    let face_m = FACE_M + U[2] * face;
    let lobe = |x: f64| if x < 1e-9 { 1.0 } else { 2.0 * libm::j1(x) / x };
    let (mut real, mut imaginary) = (0.0, 0.0);
    for element in elements {
        let way = at - element;
        let d = way.norm();
        let emitted = lobe(k * 4.5e-3 * way.xy().norm() / d);
        let sine = (1.0 - (way.dot(&axis) / d).powi(2)).max(0.0).sqrt();
        let heard = if faced { lobe(k_stated * face_m * sine) } else { 1.0 };
        let level = 4.0 * emitted * heard * (-air.attenuation_np_m(40e3) * d).exp() / d;
        let phase = k * d - k_stated * (Vec3::from(FOCUS) - element).norm();
        real += level * phase.cos();
        imaginary += level * phase.sin();
    }
    let density = 293.15 / (273.15 + temperature);
    let gain = 10f64.powf((20.0 + U[1] * amplifier) / 20.0);
    real.hypot(imaginary) * density * SENSITIVITY_V_PA * (1.0 + U[0] * sensitivity) * gain
}

#[test]
fn the_budget_of_a_peak_agrees_with_a_monte_carlo() {
    let setup = setup();
    let elements: Vec<Vec3> = setup.array.array().elements().iter().map(|e| e.centre_m).collect();
    let truth = Deviation::default();
    // A map about the focus, each point twice, as a laboratory without errors reads it; repeats differ by 0.4 %.
    let noise = |n: usize| {
        1.0 + if n.is_multiple_of(2) { 0.004 } else { -0.004 } * std::f64::consts::FRAC_1_SQRT_2
    };
    let mut samples = Vec::new();
    for n in 0..13 * 13 * 2 {
        let (column, row) = ((n / 2) % 13, n / 26);
        let at = Vec3::new(
            FOCUS[0] + (column as f64 - 6.0) * 1.5e-3,
            FOCUS[1] + (row as f64 - 6.0) * 1.5e-3,
            FOCUS[2],
        );
        let volts = reading(&elements, at, truth, true) * noise(n + column);
        samples.push(RecordedSample::measured(n as f64, Some(0), at, volts, None));
    }
    let scan = RecordedScan { setup, samples };
    let comparison = compare(&scan, Simulator::Piston, Registering::GainOnly).expect("comparable");
    let levels = comparison.levels.as_ref().expect("a sensitivity");
    let plane = &levels.planes[0];

    // The level is that of the field without a receiver: within the noise, and the error of the peak between the points.
    let [x, y] = comparison.planes[0].scan.peak_position_m.map(|along| along.value);
    let peak = Vec3::new(x, y, FOCUS[2]);
    let volts_a_pa = SENSITIVITY_V_PA * 10.0;
    let true_pa = reading(&elements, peak, truth, false) / volts_a_pa;
    let off_db = 20.0 * (plane.scan.rms_pa / true_pa).log10();
    assert!(off_db.abs() < 0.05, "{off_db}: {plane:?}");
    assert!(plane.reception_db > 0.2, "the face matters: {}", plane.reception_db);
    insta::assert_snapshot!(levels.to_text());

    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let stated = reading(&elements, peak, truth, true);
    let repeatability =
        comparison.planes[0].scan.peak.standard_error / comparison.planes[0].scan.peak.value;
    let errors: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let deviation = Deviation {
                of: std::array::from_fn(|_| normal()),
                about_x: normal(),
                place: std::array::from_fn(|_| normal()),
            };
            let read = reading(&elements, peak, deviation, true) * (1.0 + repeatability * normal());
            20.0 * (read / stated).log10()
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / DRAWS as f64;
    let deviation = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / DRAWS as f64).sqrt();
    let combined = plane.budget.combined_db;
    // Cross terms of the place and the square terms of the budget agree to some percent; the draws to 0.5 %.
    assert!(
        (combined / deviation - 1.0).abs() < 0.05,
        "{combined} {deviation}: {:#?}",
        plane.budget
    );
    let covered =
        errors.iter().filter(|e| e.abs() <= plane.expanded_db).count() as f64 / DRAWS as f64;
    assert!((0.93..0.97).contains(&covered), "{covered}");
}

#[test]
fn each_source_alone_agrees_with_its_line() {
    let setup = setup();
    let elements: Vec<Vec3> = setup.array.array().elements().iter().map(|e| e.centre_m).collect();
    let at = Vec3::from(FOCUS);
    let samples = (0..81)
        .map(|n| {
            let off = Vec3::new((n % 9) as f64 - 4.0, (n / 9) as f64 - 4.0, 0.0) * 2e-3;
            let volts = reading(&elements, at + off, Deviation::default(), true);
            RecordedSample::measured(n as f64, Some(0), at + off, volts, None)
        })
        .collect();
    let scan = RecordedScan { setup, samples };
    let comparison = compare(&scan, Simulator::Piston, Registering::GainOnly).expect("comparable");
    let plane = &comparison.levels.as_ref().expect("levels").planes[0];
    let [x, y] = comparison.planes[0].scan.peak_position_m.map(|along| along.value);
    let peak = Vec3::new(x, y, FOCUS[2]);
    let stated = reading(&elements, peak, Deviation::default(), true);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for (name, number) in [
        ("receiver's sensitivity", 0),
        ("amplifier's gain", 1),
        ("averaging over the face", 2),
        ("angle of incidence", 3),
        ("place", 4),
        ("temperature of the air", 5),
        ("relative humidity", 6),
    ] {
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let errors: Vec<f64> = (0..6000)
            .map(|_| {
                let mut deviation = Deviation::default();
                match number {
                    3 => (deviation.of[3], deviation.about_x) = (normal(), normal()),
                    4 => deviation.place = std::array::from_fn(|_| normal()),
                    other => deviation.of[other] = normal(),
                }
                20.0 * (reading(&elements, peak, deviation, true) / stated).log10()
            })
            .collect();
        let mean = errors.iter().sum::<f64>() / 6000.0;
        let scatter = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 6000.0).sqrt();
        let line = plane.budget.lines.iter().find(|line| line.source == name).expect(name);
        // A hundredth of a decibel, or a tenth of the line.
        let near = (line.contribution_db - scatter).abs() < 0.01f64.max(0.1 * scatter);
        assert!(near, "{name}: {} {scatter}", line.contribution_db);
    }
}
