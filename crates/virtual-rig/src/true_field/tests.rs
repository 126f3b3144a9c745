//! The true field against closed forms, against the simulators, and under each effect that acts on it.

use super::super::drive::Drive;
use super::super::truth::Truth;
use super::*;
use fieldgap_acoustics::rayleigh::on_axis;
use fieldgap_acoustics::{Excitation, Simulation, Simulator, delays_s};
use fieldgap_input::TomlSource;

const F_HZ: f64 = 40e3;
const AIR: Medium = Medium { speed_of_sound_m_s: 343.0 };

fn field(array: &Array, effects: &str) -> TrueField {
    let source = TomlSource::new(std::path::Path::new("truth.toml"), effects);
    let truth = Truth::from_source(&source).expect("the effects are valid");
    TrueField::new(array, AIR, F_HZ, &TrueSource::default(), truth.effects, CounterRng::new(1))
}

fn thesis_array() -> Array {
    Array::square(6, 6, 10.5e-3).expect("not empty")
}

fn focused(array: &Array, focus_m: Vec3) -> Drive {
    let delays_s = delays_s(&Excitation::Focus(focus_m), array, &AIR, F_HZ);
    Drive {
        emitting: true,
        delays_s: delays_s.into_iter().map(Some).collect(),
        ..Drive::silent(array.len())
    }
}

fn unfocused(array: &Array) -> Drive {
    Drive { emitting: true, ..Drive::silent(array.len()) }
}

fn magnitude(field: &TrueField, drive: &Drive, at_m: Vec3) -> f64 {
    field.magnitude(&field.contributions(at_m), &field.weights(&drive.outputs()), 0.0)
}

fn mm(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z) * 1e-3
}

#[test]
fn one_element_has_the_closed_form_on_its_axis() {
    let array = Array::square(1, 1, 10.5e-3).expect("not empty");
    let field = field(&array, "");
    for z_mm in [20.0, 60.0, 150.0] {
        let p = magnitude(&field, &unfocused(&array), mm(0.0, 0.0, z_mm));
        let radius_m = array.elements()[0].radius_m;
        let expected = on_axis(AIR.wavenumber_rad_m(F_HZ), radius_m, z_mm * 1e-3).norm();
        assert!((p / expected - 1.0).abs() < 1e-3, "{z_mm}");
    }
}

#[test]
fn at_the_focus_all_elements_add_up() {
    let array = thesis_array();
    let field = field(&array, "");
    let focus_m = mm(17.5, -22.5, 100.0);
    let contributions = field.contributions(focus_m);
    let most: f64 = contributions.pressures.iter().map(|p| p.norm()).sum();
    let p = magnitude(&field, &focused(&array, focus_m), focus_m);
    assert!(p / most > 0.995, "{}", p / most);
}

/// The map of the thesis's array on a plane, and where its peak is.
fn peak_mm(value: impl Fn(Vec3) -> f64, z_mm: f64) -> (f64, f64) {
    let mut best = (0.0, 0.0, 0.0);
    for x in (-35..=45).step_by(2) {
        for y in (-45..=35).step_by(2) {
            let (x, y) = (f64::from(x), f64::from(y));
            let v = value(mm(x, y, z_mm));
            if v > best.0 {
                best = (v, x, y);
            }
        }
    }
    (best.1, best.2)
}

#[test]
fn the_peak_wanders_with_height_as_the_corrected_simulator_says() {
    let array = thesis_array();
    let field = field(&array, "");
    let focus_m = mm(17.5, -22.5, 100.0);
    let drive = focused(&array, focus_m);
    let simulation = Simulation {
        simulator: Simulator::Corrected,
        array: array.clone(),
        medium: AIR,
        frequency_hz: F_HZ,
        excitation: Excitation::Focus(focus_m),
    };
    for z_mm in [50.0, 100.0, 150.0, 200.0] {
        let (x, y) = peak_mm(|at_m| magnitude(&field, &drive, at_m), z_mm);
        let (sx, sy) = peak_mm(|at_m| simulation.magnitudes(&[at_m])[0], z_mm);
        assert!((x - sx).hypot(y - sy) <= 4.0, "{z_mm}: ({x}, {y}) and ({sx}, {sy})");
    }
}

#[test]
fn a_faster_air_is_the_same_as_a_carrier_lower_by_the_ratio() {
    // Without delays only the wavelength counts.
    let array = thesis_array();
    let ratio = 347.1 / 343.0;
    let fast = field(&array, "[effects.sound-speed]\nc_m_s = 347.1\n");
    let low = field(&array, &format!("[effects.drive-frequency]\nratio = {}\n", 1.0 / ratio));
    for at_m in [mm(5.0, 8.0, 60.0), mm(-20.0, 3.0, 120.0)] {
        let (a, b) =
            (magnitude(&fast, &unfocused(&array), at_m), magnitude(&low, &unfocused(&array), at_m));
        assert!((a / b - 1.0).abs() < 1e-9);
        assert!((a / magnitude(&field(&array, ""), &unfocused(&array), at_m) - 1.0).abs() > 1e-4);
    }
}

#[test]
fn a_gradient_that_is_equal_everywhere_in_a_plane_is_another_sound_speed() {
    // Far above, a gradient along z acts as the mean speed on nearly vertical paths.
    let array = Array::square(1, 1, 10.5e-3).expect("not empty");
    let graded = field(&array, "[effects.temperature-gradient]\ngx = 0.0\ngy = 0.0\ngz = 0.2\n");
    let plain = field(&array, "");
    let at_m = mm(0.0, 0.0, 200.0);
    let phase = |f: &TrueField| f.contributions(at_m).pressures[0].arg();
    let time_s = (1.0 + 0.2 * 0.2f64).ln() / (0.2 * 343.0);
    let expected = std::f64::consts::TAU * F_HZ * (time_s - 0.2 / 343.0);
    let turned = Complex64::from_polar(1.0, phase(&graded) - phase(&plain) - expected);
    assert!(turned.arg().abs() < 1e-6);
}

#[test]
fn wind_carries_the_focus_downwind() {
    let array = thesis_array();
    let drive = focused(&array, mm(0.0, 0.0, 100.0));
    let windy = field(&array, "[effects.flow]\nvx_m_s = 10.0\nvy_m_s = 0.0\n");
    // The wind shifts a wave by v/c of its path: 2.9 mm at 100 mm.
    let level = |x_mm: f64| magnitude(&windy, &drive, mm(x_mm, 0.0, 100.0));
    assert!(level(3.0) > level(0.0) && level(3.0) > level(6.0));
}

#[test]
fn a_dead_element_is_missed_and_a_reversed_one_twice() {
    let array = thesis_array();
    let at_m = mm(10.0, 5.0, 90.0);
    let drive = focused(&array, mm(0.0, 0.0, 100.0));
    let pressure = |effects: &str| {
        let field = field(&array, effects);
        let contributions = field.contributions(at_m);
        contributions
            .pressures
            .iter()
            .zip(field.weights(&drive.outputs()))
            .map(|(p, w)| p * w)
            .sum::<Complex64>()
    };
    let whole = pressure("");
    let dead = pressure("[effects.dead-elements]\nelements = [7]\n");
    let reversed = pressure("[effects.polarity]\nelements = [7]\n");
    assert!((whole - dead).norm() > 1.0);
    assert!(((whole - reversed) - 2.0 * (whole - dead)).norm() < 1e-9);
}

#[test]
fn swapped_channels_are_swapped_delays() {
    let array = thesis_array();
    let at_m = mm(10.0, 5.0, 90.0);
    let mut drive = focused(&array, mm(20.0, 0.0, 100.0));
    let swapped =
        magnitude(&field(&array, "[effects.swapped-channels]\nelements = [3, 20]\n"), &drive, at_m);
    drive.delays_s.swap(3, 20);
    let by_hand = magnitude(&field(&array, ""), &drive, at_m);
    assert!((swapped - by_hand).abs() < 1e-9);
}

#[test]
fn a_reflection_adds_the_field_of_the_mirrored_array() {
    let array = Array::square(1, 1, 10.5e-3).expect("not empty");
    let with = field(&array, "[effects.reflection]\nheight_mm = 200.0\ncoefficient = [0.5, 0.0]\n");
    let pressure = with.contributions(mm(0.0, 0.0, 120.0)).pressures[0];
    let (k, radius_m) = (AIR.wavenumber_rad_m(F_HZ), array.elements()[0].radius_m);
    let expected = on_axis(k, radius_m, 0.12) + 0.5 * on_axis(k, radius_m, 0.28);
    assert!((pressure - expected).norm() < 1e-2, "{pressure} {expected}");
}

#[test]
fn a_face_of_some_size_averages_the_pressure() {
    // A plane-like wave at angle θ over a disc of radius b: 2 J₁(x)/x with x = k b sin θ.
    let array = Array::square(1, 1, 10.5e-3).expect("not empty");
    let at_m = Vec3::new(3.0, 0.0, 4.0);
    let ratio = magnitude(
        &field(&array, "[effects.aperture]\nradius_mm = 4.0\n"),
        &unfocused(&array),
        at_m,
    ) / magnitude(&field(&array, ""), &unfocused(&array), at_m);
    let x = AIR.wavenumber_rad_m(F_HZ) * 4e-3 * 0.6;
    let expected = fieldgap_acoustics::rayleigh::far_field_directivity(x).abs();
    assert!((ratio - expected).abs() < 0.01, "{ratio} {expected}");
}

#[test]
fn turbulence_takes_from_the_focus_what_it_gives_to_speckle() {
    let array = thesis_array();
    let focus_m = mm(0.0, 0.0, 100.0);
    let drive = focused(&array, focus_m);
    let still = field(&array, "");
    let turbulent = field(&array, "[effects.turbulence]\nrad_per_sqrt_m = 2.0\n");
    let contributions = turbulent.contributions(focus_m);
    let weights = turbulent.weights(&drive.outputs());
    let n = 2000;
    let mean_square: f64 = (0..n)
        .map(|i| turbulent.magnitude(&contributions, &weights, f64::from(i) * 0.11).powi(2))
        .sum::<f64>()
        / f64::from(n);
    // Of N like elements: N² V² coherent and N (1 - V²) incoherent, with V² = exp(-s² d).
    let visibility_2 = (-4.0 * 0.103f64).exp();
    let expected = visibility_2 + (1.0 - visibility_2) / 36.0;
    let share = mean_square / magnitude(&still, &drive, focus_m).powi(2);
    assert!((share / expected - 1.0).abs() < 0.05, "{share} {expected}");
}

#[test]
fn warmer_air_is_another_sound_speed_from_then_on() {
    let array = thesis_array();
    let drifting = field(&array, "[effects.temperature-drift]\nk_per_h = 12.0\n");
    // 5 minutes are 1 K: c² grows by 331.3² / 273.15.
    let c_m_s = (343.0f64.powi(2) + 331.3f64.powi(2) / 273.15).sqrt();
    let warm = field(&array, &format!("[effects.sound-speed]\nc_m_s = {c_m_s}\n"));
    let at_m = mm(5.0, 8.0, 160.0);
    let drive = focused(&array, mm(17.5, -22.5, 100.0));
    let phasor = |field: &TrueField, time_s: f64| {
        let contributions = field.contributions_in(field.air_at(time_s), at_m);
        field.phasor(&contributions, &field.weights(&drive.outputs()), time_s)
    };
    let (later, expected) = (phasor(&drifting, 300.0), phasor(&warm, 0.0));
    assert!((later - expected).norm() < 1e-9 * expected.norm(), "{later} {expected}");
    assert_eq!(phasor(&drifting, 0.0), phasor(&field(&array, ""), 0.0));
}

/// The image's wave at a point is the array's own at the mirrored point, and with a baffle that at its mirror image too.
#[test]
fn a_wall_adds_the_field_of_the_mirrored_points() {
    let array = thesis_array();
    let plain = field(&array, "");
    let drive = focused(&array, mm(17.5, -22.5, 100.0));
    let weights = plain.weights(&drive.outputs());
    let own = |at_m: Vec3| plain.phasor(&plain.contributions(at_m), &weights, 0.0);
    let (at_m, normal) = (mm(10.0, -5.0, 90.0), Vec3::new(0.8, 0.0, 0.6));
    let wall =
        "[effects.wall]\nnormal = [0.8, 0, 0.6]\ndistance_mm = 120\ncoefficient = [0.3, 0.4]\n";
    let mirrored = |at_m: Vec3| at_m + 2.0 * (0.12 - at_m.dot(&normal)) * normal;
    let coefficient = Complex64::new(0.3, 0.4);
    let echo = coefficient * own(mirrored(at_m));
    // The wave from behind the baffle reaches the point as the wall's wave reaches its mirror image below the array.
    let again = coefficient * own(mirrored(mm(10.0, -5.0, -90.0)));
    for (effects, expected) in [
        (wall.to_owned(), own(at_m) + echo),
        (format!("{wall}baffle = true\n"), own(at_m) + echo + again),
    ] {
        let walled = field(&array, &effects);
        let got = walled.phasor(&walled.contributions(at_m), &weights, 0.0);
        assert!((got - expected).norm() < 1e-3 * expected.norm(), "{effects}: {got} {expected}");
    }
}

/// Far from a small sphere: the incident wave at it, times its monopole and dipole.
#[test]
fn a_small_sphere_adds_its_scattered_wave() {
    let array = Array::square(1, 1, 10.5e-3).expect("not empty");
    let effects = "[effects.scatterer]\nx_mm = 0\ny_mm = 0\nz_mm = 100\nradius_mm = 0.3\n";
    let (with, without) = (field(&array, effects), field(&array, ""));
    let at_m = mm(64.0, 0.0, 52.0);
    let p = |field: &TrueField, at_m: Vec3| field.contributions(at_m).pressures[0];
    let k = AIR.wavenumber_rad_m(F_HZ);
    // 80 mm away, back towards the array.
    let (r_m, cos) = (80e-3, -0.6);
    let wave = -k * k * 0.3e-3f64.powi(3) / 3.0 * (1.0 - 1.5 * cos);
    let expected =
        p(&without, mm(0.0, 0.0, 100.0)) * wave * Complex64::from_polar(1.0 / r_m, k * r_m);
    let got = p(&with, at_m) - p(&without, at_m);
    assert!((got - expected).norm() < 0.05 * expected.norm(), "{got} {expected}");
}

#[test]
fn crosstalk_reaches_the_field_through_the_neighbours() {
    let array = Array::square(2, 1, 10.5e-3).expect("not empty");
    let with = field(&array, "[effects.crosstalk]\ncoefficient = [0.1, 0.2]\n");
    let mut drive = unfocused(&array);
    drive.delays_s = vec![Some(0.0), None];
    let weights = with.weights(&drive.outputs());
    assert_eq!(weights, [Complex64::ONE, Complex64::new(0.1, 0.2)]);
}
